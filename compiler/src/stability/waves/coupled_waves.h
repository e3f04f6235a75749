// SPDX-License-Identifier: Apache-2.0
// Perturbations of a solve for several coupled fields. Its operator is a matrix of linear forms, which multiply as
// polynomials do. By Cramer's rule each unknown is a sum of linear forms divided by the determinant.
#pragma once

#include <vector>

#include "stability/waves/wave_sum.h"

namespace dpde::stability {

constexpr std::size_t most_coupled = 4;

/// matrix[i][k]: the operator of equation i on unknown k, as a form of component 0. Returns one sum per unknown; empty
/// if all right-hand sides are 0.
std::vector<WaveSum> coupled_waves(const std::vector<std::vector<LinearForm>>& matrix,
                                   const std::vector<LinearForm>& rights);

}  // namespace dpde::stability
