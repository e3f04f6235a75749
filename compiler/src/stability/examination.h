// SPDX-License-Identifier: Apache-2.0
// What a step does to a group of states that depend on one another: waves first, then the scene's own grid, runs or
// walls.
#pragma once

#include <optional>

#include "driver/scene/session.h"
#include "stability/stability_report.h"
#include "stability/step/linear_step.h"

namespace dpde::stability {

/// Of their step. False where nothing is finite at the initial state.
bool examine_group(driver::Session& session, const LinearStep& linear, const Look& look, StabilityReport& verdict);

/// The largest stable step of the session's equations by another explicit scheme, looked at in the same ways, on its
/// own grid and between walls, too; nullopt where every step is unstable, or no step is.
std::optional<double> limit_by_other_scheme(driver::Session& session, const model::Problem& other);

/// Whether nothing grows in the scene's step.
bool grows_nothing_in(driver::Session& session, const LinearStep& linear, const Look& look);

}  // namespace dpde::stability
