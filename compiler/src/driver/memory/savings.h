// SPDX-License-Identifier: Apache-2.0
// Memory traffic that optimisations save in a step and its gradient, counted from the programs: compiles the same scene
// again with nothing left out.
#pragma once

#include <optional>

#include "driver/memory/cost.h"

namespace dpde::driver {

/// Bytes per cell. step, adjoint: as Cost::bytes. stored: bytes that a gradient stores for each step.
struct Traffic {
  double step = 0;
  std::optional<double> adjoint, stored;  // only of a task
};
Traffic traffic_of(const Compiled& compiled);

/// Whether the reverse sweep of a gradient reads any state but the last, or needs the number of substeps of a step.
bool keeps_states(const Compiled& compiled);
/// Whether the adjoint of the step reads states.
bool reads_states_back(const Compiled& compiled);

/// Traffic without savings: with terms whose parameters are 0, their coefficients, and derivatives with respect to
/// every coefficient and parameter. adjoint and stored are missing if that has no derivative.
std::optional<Traffic> traffic_in_full(const SourceFile& source, const Compiled& compiled);

}  // namespace dpde::driver
