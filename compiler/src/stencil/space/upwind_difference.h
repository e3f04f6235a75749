// SPDX-License-Identifier: Apache-2.0
// One-sided differences from the side that a flow comes from, as sums of rises: rise(0) is the rise of a field across
// the face of the cell that the flow comes through, rise(1) across the one that it leaves through, rise(-1) across the
// next one upstream, and so on. A rise goes to the higher side of the axis whichever way the flow goes. Divided by the
// width of a cell the results are derivatives along the axis; of a constant they are 0 exactly.
#pragma once

#include <functional>
#include <string>

#include "stencil/stencil.h"

namespace dpde::stencil {

using Rise = std::function<Expr(int)>;
/// Gives a value that is used several times a name, as Discretiser::shared does.
using Share = std::function<Expr(const std::string& wish, const Expr& value)>;

/// sum / denominator; the division is left to the caller.
struct UpwindDifference {
  Expr sum;
  double denominator = 1;
};

/// The difference of order 1, 3, 5 or 7 that reads (order + 1)/2 cells upstream and (order - 1)/2 downstream.
UpwindDifference upwind_difference(int order, const Rise& rise);

/// Weighted essentially non-oscillatory: a mean of differences of order (order + 1)/2 that are each smooth or weigh
/// little; where all are smooth it is the upwind difference of this order, 3 or 5 (G.-S. Jiang and D. Peng, "Weighted
/// ENO schemes for Hamilton-Jacobi equations", SIAM J. Sci. Comput. 21 (2000); order 5 as in S. Osher and R. Fedkiw,
/// "Level Set Methods" (2003), 3.25 to 3.41, order 3 likewise). The weights are those of Jiang and Shu, J. Comput.
/// Phys. 126 (1996): d_k/(epsilon + beta_k)^2, with epsilon = 1e-6 and beta_k of the rises divided by the root of the
/// sum of their squares, so that units do not matter. There is no kink. Where all rises are 0 the
/// weights are d_k. Second derivatives have the fifth power of 1/root, which leaves the range of f32: there rises are
/// multiplied by a power of two first, chosen by their size, which changes neither weights nor derivatives.
Expr weno_difference(int order, const Rise& rise, const Share& share, Precision real);

/// The slope of a straight line in a cell with the rises a and b on both sides: 0 where they differ in sign, else
///   minmod: the smaller one; van Leer: 2ab/(a + b); mc: the smallest of 2a, 2b and (a + b)/2.
/// Products of rises and, in derivatives, the square of a + b leave the range of f32 where that of f64 has room: there
/// van Leer's slope has a root, which takes longer. It is 0 where |a| + |b| is below 1e-100, in f32 below 1e-24.
/// At ties derivatives follow the rules of stencil.h: where a or b is 0 that of the slope is 0 (by van Leer: both are),
/// where minmod has two equal rises it is that of the second.
using Limiter = Expr (*)(const Expr& a, const Expr& b, const Share& share);
Expr minmod_slope(const Expr& a, const Expr& b, const Share& share);
Expr van_leer_slope(const Expr& a, const Expr& b, const Share& share);
Expr van_leer_slope_in_f32(const Expr& a, const Expr& b, const Share& share);
Expr mc_slope(const Expr& a, const Expr& b, const Share& share);

/// The difference between the values that straight lines in the cells, with limited slopes, have on the two faces, on
/// their upstream sides: f_i + s_i/2 (B. van Leer, "Towards the ultimate conservative difference scheme V", J. Comput.
/// Phys. 32 (1979)). Of order 2 and total variation diminishing.
Expr muscl_difference(Limiter limiter, const Rise& rise, const Share& share);

}  // namespace dpde::stencil
