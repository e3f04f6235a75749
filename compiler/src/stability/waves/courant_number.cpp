// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/courant_number.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/build.h"
#include "support/maths/evaluate.h"

namespace dpde::stability {

namespace {

/// The value of an expression whose only derivatives are slopes of solved fields; NaN for other expressions.
double value_at(const model::Expr& e, const FrozenPoint& point) {
  constexpr double not_known = std::numeric_limits<double>::quiet_NaN();
  if (const auto* n = as<model::Number>(e)) return n->value;
  if (const auto* p = as<model::Param>(e)) return point.params.contains(p->name) ? point.params.at(p->name) : not_known;
  if (const auto* f = as<model::Field>(e))
    return point.fields.contains(f->name) ? point.fields.at(f->name).value : not_known;
  if (const auto* c = as<model::Coordinate>(e)) return point.place[static_cast<std::size_t>(c->axis)];
  if (const auto* d = as<model::Derivative>(e)) {
    const auto* solve = as<model::Solve>(d->operand);
    if (solve == nullptr || d->order != 1 || !point.whole.contains(solve->name)) return not_known;
    const auto axis = static_cast<std::size_t>(d->axis);
    return point.whole.at(solve->name).slope[axis] / point.params.at(std::string("h").append(1, "xyz"[axis]));
  }
  if (const auto* n = as<model::Neg>(e)) return -value_at(n->operand, point);
  if (const auto* i = as<model::Interpolate>(e)) return value_at(i->operand, point);
  if (const auto* b = as<model::Binary>(e))
    return evaluate_binary(b->op, value_at(b->left, point), value_at(b->right, point));
  if (const auto* c = as<model::Call>(e))
    return evaluate_call_of(c->fn, c->arguments, [&](const model::Expr& part) { return value_at(part, point); });
  return not_known;
}

}  // namespace

std::optional<double> courant_number(const model::Problem& problem, const FrozenPoint& point, double step,
                                     const StateGroup& group) {
  double largest = 0;
  bool is_known = true;
  for (const model::State& state : problem.states) {
    if (!state.rhs || !is_in(group, state.name)) continue;
    any_part(*state.rhs, [&](const model::Expr& e) {
      const model::Advect* advect = as<model::Advect>(e);
      if (advect == nullptr) return false;
      double rate = 0;
      for (std::size_t a = 0; a < advect->velocity.size(); ++a) {
        is_known = is_known && !problem.axes[a].stretch;
        rate += std::abs(value_at(advect->velocity[a], point)) / problem.axes[a].spacing();
      }
      is_known = is_known && std::isfinite(rate);
      largest = std::max(largest, rate);
      return false;
    });
  }
  return is_known && largest * step > 1e-12 ? std::optional(largest * step) : std::nullopt;
}

}  // namespace dpde::stability
