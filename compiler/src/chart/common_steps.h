// SPDX-License-Identifier: Apache-2.0
// Which steps a scene can be run with: what is written, observed or changed at times of its own has to fall on their
// ends.
#pragma once

#include "model/model.h"

namespace dpde::chart {

/// The largest number of the problem's steps of which the run and all its times are multiples: of outputs, events,
/// controls and, of a task, of losses, tests and data.
int common_steps(const model::Problem& problem);

}  // namespace dpde::chart
