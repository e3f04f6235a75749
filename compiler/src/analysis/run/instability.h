// SPDX-License-Identifier: Apache-2.0
// Whether an unstable step makes a loss or its gradient infinite.
#pragma once

#include <string>

#include "driver/scene/session.h"

namespace dpde::analysis {

/// Describes how the run becomes unbounded, from the session's start or from a slightly perturbed one: "u grows from 1
/// to 3e+40"; "" if it does not. Repeats the run, so the session's initial and final states change.
std::string instability(driver::Session& session);

}  // namespace dpde::analysis
