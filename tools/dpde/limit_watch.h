// SPDX-License-Identifier: Apache-2.0
// Warns if changing unknowns make a step unstable that was stable at the start of the task: a larger nu, a faster wind.
#pragma once

#include "task_run.h"

namespace dpde::tools {

class LimitWatch {
 public:
  /// The task must be open.
  LimitWatch(Job& job, TaskRun& run);

  /// Call after an iteration: checks stability with these unknowns and warns of the first step above its limit. Skips
  /// iterations if checks would take more than a tenth of the time, except the first and the last one.
  void look(int iteration, const Eigen::VectorXd& x, bool is_last = false);

 private:
  std::string values_text(const Eigen::VectorXd& x) const;

  Job& job_;
  TaskRun& run_;
  double begin_ = 0, spent_ = 0;  // seconds
  bool is_told_ = false;
};

}  // namespace dpde::tools
