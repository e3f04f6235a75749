// SPDX-License-Identifier: Apache-2.0
// dpde optimize of a task that seeks controls for each window of trajectories: what the scene does with them becomes
// trajectories again, for a task that learns without the solver.
#pragma once

#include "train.h"
#include "training/window_controls.h"

namespace dpde::tools {

/// TASK.nc in the folder of --out: the states behind the first frame of each window.
Json find_controls(Job& job, const OptimizeOptions& options, const TaskRun& run, const training::TrainingScene& scene,
                   const training::BatchOptions& batch);

}  // namespace dpde::tools
