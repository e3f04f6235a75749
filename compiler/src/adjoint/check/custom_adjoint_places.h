// SPDX-License-Identifier: Apache-2.0
// Boxes of the scene's cells on which a custom adjoint is checked if it or its kernel uses coordinates: enough of them
// to find errors that occur at some positions only.
#pragma once

#include <random>
#include <vector>

#include "adjoint/adjoint.h"
#include "stencil/interpret/interpret.h"

namespace dpde::adjoint {

/// A block of cells and its position: `low` is the lower side of the first cell along each axis.
struct Box {
  stencil::Grid grid;
  std::array<double, stencil::max_rank> low{}, spacing{};
};

/// Whether the kernel or its custom adjoint depends on the position.
bool names_coordinates(const stencil::Kernel& kernel);

/// Boxes of the kernel's `surroundings`. Along each axis they cover all cells, unless these are too many. They always
/// include both ends, and both sides of every point where a condition on one coordinate changes (`x < 0.1`), up to 32
/// per axis. Conditions that mix coordinates are only sampled on large grids. The shortest boxes have `least` cells
/// along an axis, or all of its cells if it has fewer.
std::vector<Box> boxes_of(const stencil::Kernel& kernel, const Surroundings& surroundings,
                          const std::array<int, stencil::max_rank>& least, std::mt19937_64& random);

}  // namespace dpde::adjoint
