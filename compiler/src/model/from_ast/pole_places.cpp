// SPDX-License-Identifier: Apache-2.0
// What would be divided by the length of a unit of another coordinate on a pole, where that is 0. Formulas at cell
// centres have half a cell to the pole; derivatives of derivatives, and what lies on faces, are taken on the very pole.
#include <algorithm>
#include <array>

#include "model/build.h"
#include "model/formula.h"
#include "model/from_ast/parts.h"
#include "model/metric.h"
#include "model/placement.h"

namespace dpde::model {

namespace {

/// Of a formula along the axis: at centres, on faces that are none of a wall, on all faces, those on the pole too.
enum class At { centres, inner_faces, faces };

/// Along one axis with a pole at one or both of its ends.
class Divisions {
 public:
  Divisions(const Problem& problem, const Placements& placements, std::size_t axis, bool low, bool high)
      : problem_(problem), placements_(placements), axis_(axis), low_(low), high_(high) {}

  /// The division, nullptr where there is none.
  const Expr* find(const Expr& e, At at) const {
    if (const auto* d = std::get_if<Derivative>(&e->kind); d != nullptr && d->axis == static_cast<int>(axis_))
      return find(d->operand, operand_of(*d, at));
    if (const auto* here = std::get_if<Interpolate>(&e->kind)) return find(here->operand, natural(here->operand));
    if (const auto* reduce = std::get_if<Reduce>(&e->kind)) return find(reduce->operand, natural(reduce->operand));
    if (std::holds_alternative<Solve>(e->kind)) return nullptr;
    if (const auto* choice = std::get_if<Select>(&e->kind); choice != nullptr && is_about_place(choice->condition))
      return in_choice(*choice, at);
    const auto* quotient = std::get_if<Binary>(&e->kind);
    if (quotient != nullptr && quotient->op == BinaryOp::divide && at == At::faces && vanishes(quotient->right))
      return &e;
    const Expr* found = nullptr;
    for_each_part(e, [&](const Expr& part) {
      if (found == nullptr) found = find(part, at);
    });
    return found;
  }

  At natural(const Expr& e) const {
    if (!placements_.is_staggered()) return At::centres;
    const std::optional<Placement> place = placements_.natural(e);
    return place && (*place)[axis_] ? At::faces : At::centres;
  }

 private:
  /// As the differences of the back ends have it.
  At operand_of(const Derivative& d, At at) const {
    const bool is_central = d.order > 1 || (at == At::centres && !is_midway(d.operand));
    if (is_central) return at == At::inner_faces ? At::faces : at;
    return at == At::centres ? At::faces : At::centres;
  }

  /// Whether a first derivative of `e` is one between faces: `e` is on faces, or is a derivative itself.
  bool is_midway(const Expr& e) const {
    if (placements_.is_staggered() && placements_.natural(e)) return natural(e) == At::faces;
    const auto* d = std::get_if<Derivative>(&e->kind);
    if (d != nullptr && d->axis == static_cast<int>(axis_)) return is_midway(d->operand) != (d->order == 1);
    bool found = false;
    for_each_part(e, [&](const Expr& part) { found = found || is_midway(part); });
    return found;
  }

  /// In what is chosen on the poles, as far as that is known: what hangs on more than coordinates may keep them away.
  const Expr* in_choice(const Select& choice, At at) const {
    if (!is_formula(choice.condition)) return nullptr;
    const Expr* found = nullptr;
    for (const bool is_low : {true, false}) {
      if (found != nullptr || !(is_low ? low_ : high_)) continue;
      std::array<double, 3> pole{};
      for (std::size_t a = 0; a < problem_.axes.size(); ++a) pole[a] = problem_.axes[a].centre(0);
      pole[axis_] = is_low ? problem_.axes[axis_].low : problem_.axes[axis_].high;
      const Expr& chosen = value_at(choice.condition, pole) != 0 ? choice.yes : choice.no;
      found = Divisions(problem_, placements_, axis_, is_low, !is_low).find(chosen, at);
    }
    return found;
  }

  /// Whether a condition can keep the pole away: a comparison of the coordinate along the axis.
  bool is_about_place(const Expr& condition) const {
    return any_part(condition, [&](const Expr& part) {
      const auto* at = std::get_if<Coordinate>(&part->kind);
      return at != nullptr && at->axis == static_cast<int>(axis_);
    });
  }

  bool vanishes(const Expr& divisor) const {
    return (low_ && vanishes_at(problem_, divisor, axis_, true)) ||
           (high_ && vanishes_at(problem_, divisor, axis_, false));
  }

  const Problem& problem_;
  const Placements& placements_;
  std::size_t axis_;
  bool low_, high_;
};

class PolePlaces {
 public:
  PolePlaces(Draft& draft, std::size_t axis, bool low, bool high)
      : draft_(draft),
        placements_(draft.problem),
        divisions_(draft.problem, placements_, axis, low, high),
        axis_(axis) {}

  void check() {
    const Problem& problem = draft_.problem;
    for (const State& state : problem.states) {
      if (state.rhs) look_at(*state.rhs, state.placement[axis_] ? At::inner_faces : At::centres, state.origin);
    }
    for (const Event& event : problem.events) {
      for (const Event::Update& update : event.updates)
        look_at(update.value, placements_.of(update.state)[axis_] ? At::inner_faces : At::centres, event.origin);
    }
    for (const Quantity& observable : problem.observables) look_at(observable.value, At::centres, observable.origin);
    if (!problem.task) return;
    for (const Loss& loss : problem.task->losses) look_at(loss.value, At::centres, loss.origin);
    for (const Test& test : problem.task->tests) look_at(test.quantity.value, At::centres, test.quantity.origin);
  }

 private:
  void look_at(const Expr& e, At at, const Origin& origin) {
    const Expr* division = divisions_.find(e, at);
    if (division == nullptr) return;
    const SourceRange own = (*division)->origin.range;
    draft_.sink.report(
        "on-pole", own.is_known() ? own : origin.range, {},
        "take fields at cell centres, and derivatives of derivatives as lap(u) or div(k*grad(u)), or let "
        "the axis end before the pole");
  }

  Draft& draft_;
  Placements placements_;
  Divisions divisions_;
  std::size_t axis_;
};

}  // namespace

void check_pole_places(Draft& draft) {
  for (std::size_t axis = 0; axis < draft.problem.axes.size(); ++axis) {
    const bool low = is_pole_at(draft.problem, axis, true), high = is_pole_at(draft.problem, axis, false);
    if (low || high) PolePlaces(draft, axis, low, high).check();
  }
}

}  // namespace dpde::model
