// SPDX-License-Identifier: Apache-2.0
// Coefficients a and b of sides that vary. The row of a halo place (support/side_conditions.h) is a*m + b*s = c, for
// mixed with m = (u+v)/2 the value at the wall and s the derivative outwards: v moves as if c moved by -m*a_dot -
// s*b_dot. So c has a rate of its own beside that of its field, and what the transpose gives to c goes on to the
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

/// By param, in the order in which they are met: terms are added up in no order of letters.
using Slopes = std::vector<std::pair<std::string, stencil::Expr>>;

/// de/dp for each varied param p of `e`, which is made of params and numbers.
Slopes slopes_of(const stencil::Expr& e, const Varied& varied);

/// What each param p contributes to the change of m*a + s*b in `layers` halo cells beyond that side of `field`, which
/// is filled, and at its points on the walls: m*da/dp + s*db/dp there, 0 elsewhere. For a kernel that runs on the
/// region grown by `layers`.
Slopes weight_slopes(const std::string& field, const stencil::Side& side, const WallSide& at, int layers,
                     const Varied& varied);

/// From what a fold gave to c of each side with varied weights, the fields `values`, to the sums of the weights' params
/// and, where c is a field, to that. A kernel without a name, for the region grown by `layers`.
stencil::Kernel adjoint_of_weights(const stencil::Fill& fill, const std::vector<std::string>& values, int layers,
                                   const Varied& varied, DerivedNames& names, const DerivedField& bar_of_wall);

}  // namespace dpde::adjoint
