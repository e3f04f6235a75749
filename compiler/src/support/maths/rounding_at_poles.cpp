// SPDX-License-Identifier: Apache-2.0
// Rounding near zeros of divisors. For 1 - cos(z)^2 it is 1e-16 everywhere, and the whole value within 1e-8 of the
// zero.
#include <algorithm>
#include <cmath>
#include <limits>

#include "support/maths/comparisons.h"
#include "support/maths/evaluate.h"
#include "support/maths/jump_search.h"

namespace dpde {

/// First-order bound of each node's rounding error: propagated errors of its operands plus its own. Numbers and symbols
/// are exact. Infinite if an operand may leave the domain of its function.
std::vector<double> JumpSearch::rounding(const Look& look) const {
  const std::vector<double>& values = look.values;
  std::vector<double> errors(values.size(), 0);
  const auto apart = [](double value, double other) {
    if (value == other) return 0.0;  // also if both are infinite
    return std::isnan(other) ? std::numeric_limits<double>::infinity() : std::abs(other - value);
  };
  const auto change = [&](double value, double less, double more) {
    return std::max(apart(value, less), apart(value, more));
  };
  for (Id id = 0; id < values.size(); ++id) {
    const Piecewise::Node& node = formula_.nodes_[id];
    const double a = values[node.a], b = values[node.b], of_a = errors[node.a], of_b = errors[node.b];
    const double size = std::abs(values[id]);
    const double own = std::isfinite(size) ? std::numeric_limits<double>::epsilon() / 2 * size : 0;
    const auto of_operands = [&](const auto& value) {
      return (of_a > 0 ? change(values[id], value(a - of_a, b), value(a + of_a, b)) : 0) +
             (of_b > 0 ? change(values[id], value(a, b - of_b), value(a, b + of_b)) : 0);
    };
    switch (node.kind) {
      case Piecewise::Kind::number:
      case Piecewise::Kind::symbol: break;
      case Piecewise::Kind::negate: errors[id] = of_a; break;
      case Piecewise::Kind::binary:
        if (is_comparison(node.op)) break;
        errors[id] = own + of_operands([&](double x, double y) { return evaluate_binary(node.op, x, y); });
        break;
      case Piecewise::Kind::call:
        errors[id] =
            own + of_operands([&](double x, double y) { return evaluate_call(node.fn, x, node.a == node.b ? x : y); });
        break;
      case Piecewise::Kind::choice: errors[id] = a != 0 ? of_b : errors[node.c]; break;
    }
  }
  return errors;
}

/// The place, or one around it wide enough for the difference of both sides to be accurate; nullopt if that needs one
/// wider than `widest`. Invisible differences need no accuracy.
std::optional<JumpSearch::Place> JumpSearch::beyond_rounding(const Place& place, double widest) const {
  for (Place wide = place; wide.gap() <= std::max(widest, place.gap());
       wide = {wide.before - wide.gap() / 2, wide.behind + wide.gap() / 2}) {
    const Look low = look(wide.before), high = look(wide.behind);
    const double size = std::max({std::abs(low.result()), std::abs(high.result()), typical_});
    const double left = std::max(rounding(low).back(), rounding(high).back());
    if (left <= most_rounding * std::max(jump_between(low, high), smallest_jump * size)) return wide;
  }
  return std::nullopt;
}

}  // namespace dpde
