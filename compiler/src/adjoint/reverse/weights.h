// SPDX-License-Identifier: Apache-2.0
// Varied coefficients a and b of sides. The equation of a ghost cell (support/side_conditions.h) is a*m + b*s = c; for
// mixed, m = (u+v)/2 is the value at the wall and s the outward derivative. Its tangent acts like a change of c by
// -m*a_dot - s*b_dot, in addition to the tangent of c's field. The transpose passes the adjoint of c on to the
// coefficients.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "adjoint/reverse/plan.h"
#include "stencil/build.h"

namespace dpde::adjoint {

bool has_varied_weights(const stencil::Side& side, const Varied& varied);

/// One side of a bounded axis.
struct WallSide {
  int axis = 0;
  bool is_low = true;
};
std::vector<WallSide> sides_with_varied_weights(const std::vector<stencil::AxisBoundary>& axes, const Varied& varied);
const stencil::Side& side_at(const std::vector<stencil::AxisBoundary>& axes, const WallSide& at);
stencil::Side& side_at(std::vector<stencil::AxisBoundary>& axes, const WallSide& at);

/// Derivatives by param, in order of appearance, so that sums do not depend on the alphabetical order of names.
using Slopes = std::vector<std::pair<std::string, stencil::Expr>>;

/// de/dp for each varied param p of `e`, which consists of params and numbers.
Slopes slopes_of(const stencil::Expr& e, const Varied& varied);

/// For each param p the derivative m*da/dp + s*db/dp of m*a + s*b, in `layers` halo cells beyond that side of the
/// filled `field` and at its points on the walls; 0 elsewhere. For a kernel run on the region extended by `layers`.
Slopes weight_slopes(const std::string& field, const stencil::Side& side, const WallSide& at, int layers,
                     const Varied& varied);

/// A kernel that adds the adjoints of c, which a fold stored in the fields `values` for each side with varied weights,
/// to the sums of the weights' params and, if c is a field, to its adjoint. It has no name and runs on the region
/// extended by `layers`.
stencil::Kernel adjoint_of_weights(const stencil::Fill& fill, const std::vector<std::string>& values, int layers,
                                   const Varied& varied, DerivedNames& names, const DerivedField& bar_of_wall);

}  // namespace dpde::adjoint
