// SPDX-License-Identifier: Apache-2.0
// Conditions under which a value is used. Its derivative is selected, never multiplied by 0, so that the branch that is
// not taken may be NaN.
#pragma once

#include <vector>

#include "stencil/build.h"
#include "stencil/passes/polynomial.h"

namespace dpde::adjoint {

struct Guard {
  stencil::Expr condition;
  bool yes;
  bool operator==(const Guard&) const = default;
};
using Guards = std::vector<Guard>;

/// `e` where all guards hold, else 0.
inline stencil::Expr guarded(stencil::Expr e, const Guards& guards) {
  for (auto guard = guards.rbegin(); guard != guards.rend(); ++guard) {
    e = guard->yes ? stencil::select(guard->condition, e, 0.0) : stencil::select(guard->condition, 0.0, e);
  }
  return e;
}

/// The same for the position of a scatter. Where the guards do not hold its value is 0 already, but 0 times a NaN
/// weight would be NaN.
inline stencil::Interp guarded(stencil::Interp i, const Guards& guards) {
  for (stencil::Expr& d : i.displacement) {
    if (!stencil::is_uniform(d)) d = guarded(d, guards);
  }
  return i;
}

/// A contribution that counts where all of its guards hold.
struct GuardedBar {
  Guards guards;
  stencil::Expr bar;
};
/// The sum of the contributions; each condition is evaluated once for all that depend on it.
stencil::Expr sum_of(const std::vector<GuardedBar>& bars);
/// 1 where the guards of any contribution hold, else 0; the literal 1 if they always hold.
stencil::Expr any_of(const std::vector<GuardedBar>& bars);

}  // namespace dpde::adjoint
