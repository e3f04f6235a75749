// SPDX-License-Identifier: Apache-2.0
// Results of rollouts' tuning of sweeps over large fields (Rollout::tuning), cached with the code.
#pragma once

#include <string>

#include "dpde/runtime/rollout.h"
#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// Whether fields exceed a core's own cache. Then the fastest code depends on the machine, and compiling variants costs
/// little compared with the run.
bool is_worth_tuning(const Compiled& compiled);

/// Whether vectorised, optimised code saves more run time than its compilation takes. Both grow with the terms of the
/// rows, so cells times steps decide. True if these are not known.
bool is_worth_optimising(const Compiled& compiled);
/// Whether its code is not optimised: JIT code for which that is not worth it.
bool has_quick_code(const Compiled& compiled);
inline constexpr double runs_of_an_iteration = 3;  // by an optimiser with its line search, each with a gradient

/// For RolloutSetup::tuning; "" if nothing is cached.
std::string find_tuning(const Compiled& compiled, const RolloutSetup& setup);

/// Stores `tuning`; does nothing if it is empty.
void keep_tuning(const Compiled& compiled, const RolloutSetup& setup, const std::string& tuning);

}  // namespace dpde::driver
