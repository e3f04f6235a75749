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
  if (const auto* n = std::get_if<model::Number>(&e->kind)) return n->value;
  if (const auto* p = std::get_if<model::Param>(&e->kind))
    return point.params.contains(p->name) ? point.params.at(p->name) : not_known;
  if (const auto* f = std::get_if<model::Field>(&e->kind))
    return point.fields.contains(f->name) ? point.fields.at(f->name).value : not_known;
  if (const auto* c = std::get_if<model::Coordinate>(&e->kind)) return point.place[static_cast<std::size_t>(c->axis)];
  if (const auto* d = std::get_if<model::Derivative>(&e->kind)) {
    const auto* solve = std::get_if<model::Solve>(&d->operand->kind);
    if (solve == nullptr || d->order != 1 || !point.whole.contains(solve->name)) return not_known;
    const auto axis = static_cast<std::size_t>(d->axis);
    return point.whole.at(solve->name).slope[axis] / point.params.at(std::string("h").append(1, "xyz"[axis]));
  }
  if (const auto* n = std::get_if<model::Neg>(&e->kind)) return -value_at(n->operand, point);
  if (const auto* i = std::get_if<model::Interpolate>(&e->kind)) return value_at(i->operand, point);
  if (const auto* b = std::get_if<model::Binary>(&e->kind))
    return evaluate_binary(b->op, value_at(b->left, point), value_at(b->right, point));
  if (const auto* c = std::get_if<model::Call>(&e->kind))
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
    model::any_part(*state.rhs, [&](const model::Expr& e) {
      const model::Advect* advect = std::get_if<model::Advect>(&e->kind);
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
