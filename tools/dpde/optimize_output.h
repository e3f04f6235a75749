// SPDX-License-Identifier: Apache-2.0
// Results of an optimisation: losses as a table and a curve, unknowns as arrays, and a picture of target, result and
// recovered initial state.
#pragma once

#include "dpde/runtime/optimise.h"
#include "task_run.h"

namespace dpde::tools {

/// Writes loss.csv, loss.svg/png, NAME.npy of each unknown initial state, TASK.svg/png; prints the loss on a terminal.
void write_optimised(Job& job, TaskRun& run, const OptimiseResult& result);

}  // namespace dpde::tools
