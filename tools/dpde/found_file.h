// SPDX-License-Identifier: Apache-2.0
// TASK.found in the folder of --out: the exact result of `optimize` for a task that does not learn from trajectories,
// for `test`.
#pragma once

#include "task_run.h"

namespace dpde::tools {

void save_found(Job& job, const TaskRun& run, const Eigen::VectorXd& x);
/// nullopt after a diagnostic: the file does not exist, is damaged, or has other unknowns.
std::optional<Eigen::VectorXd> load_found(Job& job, const TaskRun& run, const std::string& folder);

}  // namespace dpde::tools
