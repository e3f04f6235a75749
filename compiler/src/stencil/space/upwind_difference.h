// SPDX-License-Identifier: Apache-2.0
// Upwind differences as sums of rises, the differences of a field across faces: rise(0) is across the cell's inflow
// face, rise(1) across its outflow face, rise(-1) across the next face upstream, and so on. A rise is the value on the
// higher side of the axis minus that on the lower side, for both directions of the flow. Divided by the cell width the
// results are derivatives along the axis; they are exactly 0 for a constant.
#pragma once

#include <functional>
#include <string>

#include "stencil/stencil.h"

namespace dpde::stencil {

using Rise = std::function<Expr(int)>;
/// Names a value that is used several times, as Discretiser::shared does.
using Share = std::function<Expr(const std::string& wish, const Expr& value)>;

/// sum / denominator; the caller divides.
struct UpwindDifference {
  Expr sum;
  double denominator = 1;
};

/// The difference of order 1, 3, 5 or 7 that reads (order + 1)/2 cells upstream and (order - 1)/2 downstream.
UpwindDifference upwind_difference(int order, const Rise& rise);

/// Weighted essentially non-oscillatory: a mean of differences of order (order + 1)/2, with small weights where they
/// are not smooth; if all are smooth it is the upwind difference of this order, 3 or 5 (G.-S. Jiang and D. Peng,
/// "Weighted ENO schemes for Hamilton-Jacobi equations", SIAM J. Sci. Comput. 21 (2000); order 5 as in S. Osher and
/// R. Fedkiw, "Level Set Methods" (2003), 3.25 to 3.41, order 3 likewise). The weights are those of Jiang and Shu,
/// J. Comput. Phys. 126 (1996): d_k/(epsilon + beta_k)^2, with epsilon = 1e-6 and beta_k of the rises divided by the
/// root of the sum of their squares, so that units do not matter. There is no kink. If all rises are 0 the weights are
/// d_k.
/// Second derivatives contain the fifth power of 1/root, which exceeds the range of f32: in f32 rises are first
/// multiplied by a power of two, chosen by their size, which changes neither weights nor derivatives.
Expr weno_difference(int order, const Rise& rise, const Share& share, Precision real);

/// The slope of a straight line in a cell with the rises a and b on both sides: 0 where they differ in sign, else
///   minmod: the smaller one; van Leer: 2ab/(a + b); mc: the smallest of 2a, 2b and (a + b)/2.
/// Products of rises and, in derivatives, the square of a + b exceed the range of f32 but not of f64. In f32 van Leer's
/// slope therefore uses a square root, which is slower. It is 0 if |a| + |b| is below 1e-100, in f32 below 1e-24.
/// At ties derivatives follow the rules of stencil.h: where a or b is 0 the slope's derivative is 0 (van Leer: where
/// both are), and for two equal rises minmod has the derivative of the second.
using Limiter = Expr (*)(const Expr& a, const Expr& b, const Share& share);
Expr minmod_slope(const Expr& a, const Expr& b, const Share& share);
Expr van_leer_slope(const Expr& a, const Expr& b, const Share& share);
Expr van_leer_slope_in_f32(const Expr& a, const Expr& b, const Share& share);
Expr mc_slope(const Expr& a, const Expr& b, const Share& share);

/// Difference between the upstream values on the two faces, of a linear reconstruction with limited slopes:
/// f_i + s_i/2 (B. van Leer, "Towards the ultimate conservative difference scheme V", J. Comput. Phys. 32 (1979)).
/// Order 2, total variation diminishing.
Expr muscl_difference(Limiter limiter, const Rise& rise, const Share& share);

}  // namespace dpde::stencil
