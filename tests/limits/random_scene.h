// SPDX-License-Identifier: Apache-2.0
// Random scenes for tests of stability limits: groups of equations with walls, events, multistep schemes, solves,
// masks, networks and coordinates. They have so few cells that the full tangent of a step can be found by runs.
#pragma once

#include <cstdint>

#include "random/text_tree.h"

namespace dpde::testing {

/// The text of a scene `s`; the same for the same seed on all machines.
Part random_scene(std::uint64_t seed);

}  // namespace dpde::testing
