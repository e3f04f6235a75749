// SPDX-License-Identifier: Apache-2.0
// dpde optimize for a task that finds controls for each window of trajectories: the controlled runs form new
// trajectories, for a task that learns without the solver.
#pragma once

#include "train.h"
#include "training/window_controls.h"

namespace dpde::tools {

/// Writes TASK.nc to the folder of --out: the states after the first frame of each window.
Json find_controls(Job& job, const OptimizeOptions& options, const TaskRun& run, const training::TrainingScene& scene,
                   const training::BatchOptions& batch);

}  // namespace dpde::tools
