// SPDX-License-Identifier: Apache-2.0
#include "adjoint/check/guards.h"

#include <functional>

namespace dpde::adjoint {

using namespace stencil;

namespace {

using Join = std::function<Expr(const Expr&, const Expr&)>;

/// Joins the entries without guards, and for each condition a selection between the entries of both branches.
Expr joined(const std::vector<GuardedBar>& bars, const Join& join) {
  Expr result = 0.0;
  std::vector<GuardedBar> rest;
  for (const GuardedBar& each : bars) {
    if (each.guards.empty()) {
      result = join(result, each.bar);
    } else {
      rest.push_back(each);
    }
  }
  while (!rest.empty()) {
    const Expr condition = rest.front().guards.front().condition;
    std::vector<GuardedBar> yes, no, others;
    for (GuardedBar& each : rest) {
      const Guard first = each.guards.front();
      const bool is_of_it = first.condition == condition;
      if (is_of_it) each.guards.erase(each.guards.begin());
      (!is_of_it ? others : first.yes ? yes : no).push_back(std::move(each));
    }
    result = join(result, select(condition, joined(yes, join), joined(no, join)));
    rest = std::move(others);
  }
  return result;
}

}  // namespace

Expr sum_of(const std::vector<GuardedBar>& bars) {
  return joined(bars, [](const Expr& a, const Expr& b) { return a + b; });
}

Expr any_of(const std::vector<GuardedBar>& bars) {
  std::vector<GuardedBar> ones = bars;
  for (GuardedBar& each : ones) each.bar = 1.0;
  return joined(ones, [](const Expr& a, const Expr& b) {
    if (is_literal(a, 0) || is_literal(b, 1)) return b;
    return is_literal(b, 0) || is_literal(a, 1) ? a : call(Fn::max, {a, b});
  });
}

}  // namespace dpde::adjoint
