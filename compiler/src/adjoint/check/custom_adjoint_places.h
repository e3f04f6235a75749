// SPDX-License-Identifier: Apache-2.0
// Where an adjoint that a person gives is checked, when it or its kernel names coordinates: small boxes of the scene's
// own cells, so many that what holds at some places only is seen.
#pragma once

#include <random>
#include <vector>

#include "adjoint/adjoint.h"
#include "stencil/interpret/interpret.h"

namespace dpde::adjoint {

/// Cells that lie side by side, and where: along each axis low is the lower side of the first one.
struct Box {
  stencil::Grid grid;
  std::array<double, stencil::max_rank> low{}, spacing{};
};

/// Whether what the kernel does, or what is given for it, depends on the place.
bool names_coordinates(const stencil::Kernel& kernel);

/// Boxes of the kernel's `surroundings`. Along each axis they cover all cells, where these are not too many, and both
/// ends and both sides of every place where a condition on one coordinate changes (`x < 0.1`), up to 32 an axis, in any
/// case; of conditions that mix coordinates on large grids only samples are seen. The shortest have `least` cells along
/// an axis, where it has so many.
std::vector<Box> boxes_of(const stencil::Kernel& kernel, const Surroundings& surroundings,
                          const std::array<int, stencil::max_rank>& least, std::mt19937_64& random);

}  // namespace dpde::adjoint
