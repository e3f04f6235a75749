// SPDX-License-Identifier: Apache-2.0
// What a step does to a group of states that depend on one another: waves first, then the scene's own grid, runs or
// walls.
#pragma once

#include "driver/session.h"
#include "stability/linear_step.h"
#include "stability/verdict.h"

namespace dpde::stability {

/// Of their step. False where nothing is finite at the initial state.
bool examine_group(driver::Session& session, const LinearStep& linear, Verdict& verdict);

/// Whether nothing grows in the scene's step.
bool grows_nothing_in(driver::Session& session, const LinearStep& linear);

}  // namespace dpde::stability
