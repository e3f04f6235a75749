// SPDX-License-Identifier: Apache-2.0
// Random scenes whose largest stable step is asked for: groups of equations with walls, events, memories, solves,
// masks, networks and coordinates, on so few cells that all of a step's tangent can be found by runs.
#pragma once

#include <cstdint>

#include "random/text_tree.h"

namespace dpde::testing {

/// With the scene `s`; the same for the same seed, everywhere.
Part random_scene(std::uint64_t seed);

}  // namespace dpde::testing
