// SPDX-License-Identifier: Apache-2.0
// Conditions under which a value is used. Its derivative is selected, never multiplied by 0, so that a branch not taken
// may hold NaN.
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

/// `e` where all of them hold, else 0.
inline stencil::Expr guarded(stencil::Expr e, const Guards& guards) {
  for (auto guard = guards.rbegin(); guard != guards.rend(); ++guard) {
    e = guard->yes ? stencil::select(guard->condition, e, 0.0) : stencil::select(guard->condition, 0.0, e);
  }
  return e;
}

/// The same for a place: what is added there is 0, but not where the weights are NaN.
inline stencil::Interp guarded(stencil::Interp i, const Guards& guards) {
  for (stencil::Expr& d : i.displacement) {
    if (!stencil::is_uniform(d)) d = guarded(d, guards);
  }
  return i;
}

/// What counts where all of its guards hold.
struct GuardedBar {
  Guards guards;
  stencil::Expr bar;
};
/// Their sum: each condition is asked once, for all that hang on it.
stencil::Expr sum_of(const std::vector<GuardedBar>& bars);
/// 1 where the guards of any of them hold, else 0; 1 by itself where they leave nothing out.
stencil::Expr any_of(const std::vector<GuardedBar>& bars);

}  // namespace dpde::adjoint
