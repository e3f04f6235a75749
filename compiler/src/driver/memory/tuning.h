// SPDX-License-Identifier: Apache-2.0
// What rollouts find out about the fastest way to sweep over large fields (Rollout::tuning), kept in the cache beside
// the code.
#pragma once

#include <string>

#include "dpde/runtime/rollout.h"
#include "driver/compile/pipeline.h"

namespace dpde::driver {

/// Fields that leave the core's own cache: it depends on the machine which code is fastest for them, and compiling more
/// of it is nothing beside the run.
bool is_worth_tuning(const Compiled& compiled);

/// Whether code that is vectorised and optimised saves more time in the run than it takes to make: both grow with the
/// terms of the rows, so that the cells times the steps decide. Where those are not known it does.
bool is_worth_optimising(const Compiled& compiled);
/// Whether its code is not optimised: that of the JIT where it is not worth it.
bool has_quick_code(const Compiled& compiled);
inline constexpr double runs_of_an_iteration = 3;  // of an optimiser with its line search, each with a gradient

/// For RolloutSetup::tuning; "" when nothing is kept.
std::string find_tuning(const Compiled& compiled, const RolloutSetup& setup);

/// Does nothing where nothing has been found out.
void keep_tuning(const Compiled& compiled, const RolloutSetup& setup, const std::string& tuning);

}  // namespace dpde::driver
