// SPDX-License-Identifier: Apache-2.0
// Ranks that are threads of one process: a divided grid without a network, for tests.
//
//   run_ranks({2, 2, 1}, [&](Communicator& ranks) { ... make_subgrid(global, ranks.ranks(), ranks.place(), halo) ...
//   });
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "dpde/runtime/communicator.h"

namespace dpde {

/// Calls `f` for each rank, in a thread of its own. If one throws, the others end when they next wait for it, and
/// run_ranks() rethrows its exception.
/// @throws Error(run) if ranks do not make the same calls.
void run_ranks(const std::array<int64_t, 3>& ranks, const std::function<void(Communicator& rank)>& f);

}  // namespace dpde
