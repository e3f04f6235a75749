// SPDX-License-Identifier: Apache-2.0
// Unknowns on their way may make a step unstable that was stable where the task began: a larger nu, a faster wind.
#pragma once

#include "task_run.h"

namespace dpde::tools {

class LimitWatch {
 public:
  /// Of a task that is open.
  LimitWatch(Job& job, TaskRun& run);

  /// Behind an iteration: the verdict with these unknowns. The first step above its limit is a warning. Iterations are
  /// left out where looking would take more than a tenth of the time, but for the first one and the last.
  void look(int iteration, const Eigen::VectorXd& x, bool is_last = false);

 private:
  std::string values_text(const Eigen::VectorXd& x) const;

  Job& job_;
  TaskRun& run_;
  double begin_ = 0, spent_ = 0;  // seconds
  bool is_told_ = false;
};

}  // namespace dpde::tools
