// SPDX-License-Identifier: Apache-2.0
// Possible steps of a scene: the times of outputs, observations and events must be multiples of the step.
#pragma once

#include "model/model.h"

namespace dpde::chart {

/// The largest number of the problem's steps that divides the run and all its times: of outputs, events, controls and,
/// for a task, of losses, tests and data.
int common_steps(const model::Problem& problem);

}  // namespace dpde::chart
