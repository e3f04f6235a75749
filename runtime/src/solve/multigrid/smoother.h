// SPDX-License-Identifier: Apache-2.0
// The smoothers of a multigrid level, on the way down and, reversed, on the way up.
//
// red_black: red cells, then black ones (Gauss-Seidel in that order). The others make two steps x += factor*(b -
// A*x)/diagonal of all cells. The eigenvalues of A/diagonal lie in [0, 2], those of modes that the next level cannot
// represent in [s, 2]; s is the smallest share of a coarsened axis in a cell's couplings: 1/2 on two axes, 1/3 on
// three. Both factors of Jacobi are 2/(2 + s), the best constant one (Trottenberg et al. 2001, section 2.1);
// Chebyshev's are the inverse roots of the polynomial that is smallest on [s, 2] (Adams et al. 2003).
#pragma once

#include <array>

namespace dpde {

/// automatic: red_black, whose steps are the cheapest, but Chebyshev if the axes are coupled unevenly, since red_black
/// then reduces too little (128 x 128 cells of aspect 10: 11 cycles and 5).
enum class SmootherKind { automatic, red_black, jacobi, chebyshev };

/// Factors of the two steps of jacobi and chebyshev.
std::array<double, 2> factors_of(SmootherKind smoother, double least_share);

}  // namespace dpde
