// SPDX-License-Identifier: Apache-2.0
// Sparsity of the matrix of a solve.
#pragma once

#include <array>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Stencil radius of the operator: along each axis the largest distance between an image and an unknown on which it
/// depends; -1: unlimited.
std::array<int, max_rank> reach_of_operator(const Module& module, const Solve& solve, std::size_t rank);

}  // namespace dpde::stencil
