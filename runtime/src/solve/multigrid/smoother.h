// SPDX-License-Identifier: Apache-2.0
// What a level of multigrid smooths by, on the way down and, reversed, on the way up.
//
// red_black: red cells, then black ones (Gauss and Seidel's iteration in that order). The others take two steps
// x += factor*(b - A*x)/diagonal of all cells at once. The eigenvalues of A/diagonal lie in [0, 2], those of the waves
// that the next level cannot show in [s, 2]; s is the least share that one of its axes has of a cell's couplings: 1/2
// on two axes, 1/3 on three. Jacobi's factors are both 2/(2 + s), the best one that is the same in all steps
// (Trottenberg et al. 2001, section 2.1); Chebyshev's are the inverse roots of the polynomial that is smallest on [s,
// 2] (Adams et al. 2003).
#pragma once

#include <array>

namespace dpde {

/// automatic: red_black, whose steps cost least, but Chebyshev's where the axes are coupled unevenly: there colours
/// leave too much (128 x 128 cells of aspect 10: 11 cycles and 5).
enum class SmootherKind { automatic, red_black, jacobi, chebyshev };

/// Of the two steps of jacobi and chebyshev.
std::array<double, 2> factors_of(SmootherKind smoother, double least_share);

}  // namespace dpde
