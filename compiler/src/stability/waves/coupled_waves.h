// SPDX-License-Identifier: Apache-2.0
// What a solve for several fields at once makes of perturbations. Its operator is a matrix of sums of displaced
// perturbations, which multiply as polynomials do: by Cramer's rule each unknown is a sum of such sums over the
// determinant.
#pragma once

#include <vector>

#include "stability/waves/wave_sum.h"

namespace dpde::stability {

constexpr std::size_t most_coupled = 4;

/// matrix[i][k]: what the image i is of the unknown k, of component 0. One sum an unknown; none where all rights are 0.
std::vector<WaveSum> coupled_waves(const std::vector<std::vector<LinearForm>>& matrix,
                                   const std::vector<LinearForm>& rights);

}  // namespace dpde::stability
