// SPDX-License-Identifier: Apache-2.0
// What a step and its gradient are spared, counted from the programs: the same scene compiled once more with nothing
// left out.
#pragma once

#include <optional>

#include "driver/memory/cost.h"

namespace dpde::driver {

/// Bytes a cell. Of a step and of its adjoint: as Cost::bytes. Of a gradient: those it stores of each step.
struct Traffic {
  double step = 0;
  std::optional<double> adjoint, stored;  // of a task
};
Traffic traffic_of(const Compiled& compiled);

/// Whether the way back of a gradient reads any state but the last, or has to know into how many parts a step was
/// split.
bool keeps_states(const Compiled& compiled);
/// Whether the adjoint of the step reads states.
bool reads_states_back(const Compiled& compiled);

/// With terms of parameters that are 0, coefficients that only those read, and derivatives by every coefficient and
/// parameter of the scene, sought or not. adjoint and stored are missing where that has no derivative.
std::optional<Traffic> traffic_in_full(const SourceFile& source, const Compiled& compiled);

}  // namespace dpde::driver
