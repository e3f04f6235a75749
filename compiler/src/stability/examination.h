// SPDX-License-Identifier: Apache-2.0
// The stability of a step for a group of states that depend on one another. Fourier modes are checked first, then the
// scene's own grid, runs of the tangent, or walls.
#pragma once

#include <optional>

#include "driver/scene/session.h"
#include "stability/stability_report.h"
#include "stability/step/linear_step.h"

namespace dpde::stability {

/// Fills the verdict on the linear step of a group. False if no tangent is finite at the initial state.
bool examine_group(driver::Session& session, const LinearStep& linear, const Look& look, StabilityReport& verdict);

/// The largest stable step of the session's equations with another explicit scheme, by the same checks; nullopt if
/// every step is unstable, or none is.
std::optional<double> limit_by_other_scheme(driver::Session& session, const model::Problem& other);

/// Whether no disturbance grows in the scene's step.
bool grows_nothing_in(driver::Session& session, const LinearStep& linear, const Look& look);

}  // namespace dpde::stability
