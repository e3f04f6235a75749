// SPDX-License-Identifier: Apache-2.0
// How sparse the matrix of a solve is.
#pragma once

#include <array>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// How many cells away along each axis the unknown may lie that the image in a cell is made of; -1: anywhere.
std::array<int, max_rank> reach_of_operator(const Module& module, const Solve& solve, std::size_t rank);

}  // namespace dpde::stencil
