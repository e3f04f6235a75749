// SPDX-License-Identifier: Apache-2.0
// Finds divisions by the length of a unit of another coordinate on a pole, where it is 0. Formulas at cell centres keep
// half a cell distance; nested derivatives and formulas on faces are evaluated on the pole itself.
#include <array>
#include <cmath>
#include <cstdlib>
#include <set>
#include <utility>

#include "model/analyse/formula.h"
#include "model/analyse/placement.h"
#include "model/boundary/metric.h"
#include "model/build.h"
#include "model/from_ast/names/known_values.h"
#include "model/from_ast/parts.h"
#include "model/uses.h"

namespace dpde::model {

namespace {

// Distance from the pole, in half cells along the axis, of the nearest evaluation of a formula: 0 is on the pole, 1 the
// centre next to it, 2 the next face. Further evaluations follow at all centres, or at all faces.
constexpr int on_pole = 0, beside_it = 1, inner_face = 2;

/// The nearest point that a difference reads, which extends `halves` half cells further. Beyond the pole there are
/// centres and faces again.
int reaching(int nearest, int halves) { return nearest >= halves ? nearest - halves : (nearest + halves) % 2; }

/// For the pole at one end of an axis.
class Divisions {
 public:
  Divisions(const Elaboration& elaboration, const Placements& placements, std::size_t axis, bool is_low)
      : problem_(elaboration.problem),
        placements_(placements),
        values_(elaboration.problem.task ? values_at_start(elaboration) : elaboration.params.values),
        axis_(axis),
        is_low_(is_low) {}

  /// The division by a length of 0, or a formula that is unbounded there; nullptr if there is none.
  const Expr* find(const Expr& e, int nearest) const {
    if (nearest == on_pole && depends_on_axis(e, static_cast<int>(axis_))) {
      const Expr formula = with_numbers(e, 0), other = with_numbers(e, 1);  // a factor may be 0 in one of them
      if (is_formula(formula) && is_formula(other)) return is_unbounded(formula) || is_unbounded(other) ? &e : nullptr;
    }
    if (const auto* d = as<Derivative>(e); d != nullptr && d->axis == static_cast<int>(axis_))
      return find(d->operand, read_by(*d, nearest));
    if (const auto* here = as<Interpolate>(e)) {
      const bool is_apart = natural(here->operand) % 2 != nearest % 2;
      return find(here->operand, is_apart ? reaching(nearest, derivative_reach() - 1) : nearest);
    }
    if (const auto* reduce = as<Reduce>(e)) return find(reduce->operand, natural(reduce->operand));
    if (const auto* shift = as<Shift>(e))
      return find(shift->operand, reaching(nearest, 2 * std::abs(shift->offset[axis_])));
    if (const auto* solve = as<Solve>(e)) {  // at cell centres
      const Expr* found = find(solve->operation, beside_it);
      return found != nullptr ? found : find(solve->right, beside_it);
    }
    if (const auto* choice = as<Select>(e)) return in_choice(*choice, nearest);
    const auto* quotient = as<Binary>(e);
    const bool is_divided = quotient != nullptr && quotient->op == BinaryOp::divide && nearest == on_pole;
    if (is_divided && is_unbounded_divisor(with_numbers(quotient->right, 0))) return &e;
    const Expr* found = nullptr;
    for_each_child(e, [&](const Expr& part) {
      if (found == nullptr) found = find(part, nearest);
    });
    return found;
  }

  int natural(const Expr& e) const {
    if (!placements_.is_staggered()) return beside_it;
    const std::optional<Placement> place = placements_.natural(e);
    return place && (*place)[axis_] ? on_pole : beside_it;
  }

 private:
  const Axis& axis() const { return problem_.axes[axis_]; }

  /// Substitutes the initial values of parameters, or other values, since a factor that happens to be 0 hides its
  /// cofactor. Anything without a value, as t and controls, gets an arbitrary number.
  Expr with_numbers(const Expr& e, double others) const {
    constexpr double odd = 0.7316, growth = 0.3717;
    KnownValues values = values_;
    any_part(e, [&](const Expr& part) {
      const auto* param = as<Param>(part);
      if (param != nullptr && !values[param->name]) values[param->name] = odd;
      return false;
    });
    for (auto& [name, value] : values) value = value.value_or(odd) * (1 + others * growth) + others * odd;
    return with_known(e, values);
  }

  bool is_unbounded_divisor(const Expr& divisor) const {
    return is_formula(divisor) && is_unbounded(binary(BinaryOp::divide, 1.0, divisor));
  }

  /// Detects growth towards the pole by a power of the distance.
  bool is_unbounded(const Expr& formula) const {
    constexpr double way = 1e-3, most_growth = 1e5;  // between this fraction of the axis and the pole
    const auto at = [&](double part) {
      std::array<double, 3> place{};
      for (std::size_t a = 0; a < problem_.axes.size(); ++a) place[a] = problem_.axes[a].centre(0);
      place[axis_] =
          is_low_ ? axis().low + part * (axis().high - axis().low) : axis().high - part * (axis().high - axis().low);
      return std::abs(value_at(formula, place));
    };
    return !(at(0) <= most_growth * at(way));
  }

  /// Same stencils as in the back ends.
  int read_by(const Derivative& d, int nearest) const {
    const bool is_central = d.order > 1 || (nearest % 2 != 0 && !is_midway(d.operand));
    const int reach =
        d.order > 1 ? reach_of(problem_.scheme.laplacian_order) + (d.order > 2 ? 2 : 0) : derivative_reach();
    return reaching(nearest, is_central ? reach : reach - 1);
  }
  /// In half cells, of a central difference.
  int reach_of(int order) const { return order == spectral ? 2 * axis().cells : order; }
  int derivative_reach() const { return reach_of(problem_.scheme.derivative_order); }

  /// Whether a first derivative of `e` may be a difference between faces: `e` can be evaluated there, or is a
  /// derivative itself.
  bool is_midway(const Expr& e) const {
    std::optional<Placement> place = placements_.is_staggered() ? placements_.natural(e) : std::nullopt;
    if (!place) return belongs_midway(e);
    (*place)[axis_] = true;
    return placements_.can_be_at(e, *place) || belongs_midway(e);
  }
  /// For formulas of fields at centres.
  bool belongs_midway(const Expr& e) const {
    const auto* d = as<Derivative>(e);
    if (d != nullptr && d->axis == static_cast<int>(axis_)) return belongs_midway(d->operand) != (d->order == 1);
    return any_child(e, [&](const Expr& part) { return belongs_midway(part); });
  }

  /// Each branch from the first point where it is chosen, as far as known.
  const Expr* in_choice(const Select& choice, int nearest) const {
    const Expr* found = find(choice.condition, nearest);
    for (const bool holds : {true, false}) {
      int place = nearest;
      while (place <= 2 * axis().cells && truth(choice.condition, place) == !holds) place += 2;
      if (found == nullptr && place <= 2 * axis().cells) found = find(holds ? choice.yes : choice.no, place);
    }
    return found;
  }

  /// Whether a condition holds at a point; nullopt if it depends on more than the coordinate along the axis.
  std::optional<bool> truth(const Expr& condition, int place) const {
    const bool is_elsewhere = any_part(condition, [&](const Expr& part) {
      const auto* at = as<Coordinate>(part);
      return at != nullptr && at->axis != static_cast<int>(axis_);
    });
    if (!is_elsewhere && is_formula(condition)) return value_at(condition, coordinate(place)) != 0;
    const auto* both = as<Binary>(condition);
    if (both == nullptr || (both->op != BinaryOp::logical_and && both->op != BinaryOp::logical_or)) return std::nullopt;
    const auto left = truth(both->left, place), right = truth(both->right, place);
    const bool decides = both->op == BinaryOp::logical_or;  // whatever the other operand is
    if (left == decides || right == decides) return decides;
    return left && right ? std::optional(!decides) : std::nullopt;
  }

  double coordinate(int place) const {
    const bool is_first = is_low_ != axis().runs_down();
    const int i = is_first ? place / 2 : axis().cells - (place + 1) / 2;
    return place % 2 == 0 ? axis().face(i) : axis().centre(i);
  }

  const Problem& problem_;
  const Placements& placements_;
  KnownValues values_;
  std::size_t axis_;
  bool is_low_;
};

class PolePlaces {
 public:
  PolePlaces(Elaboration& elaboration, std::size_t axis, bool is_low)
      : elaboration_(elaboration),
        placements_(elaboration.problem),
        divisions_(elaboration, placements_, axis, is_low),
        axis_(axis) {}

  void check() {
    for_each_formula(elaboration_.problem, [&](const Use& use) {
      if (!is_of_states(use.kind)) return;  // the others contain no differences that could divide by lengths
      look_at(use.formula, use.home[axis_] ? inner_face : beside_it, use.origin);
    });
  }

 private:
  void look_at(const Expr& e, int nearest, const Origin& origin) {
    const Expr* division = divisions_.find(e, nearest);
    if (division == nullptr) return;
    const SourceRange own = (*division)->origin.range, place = own.is_known() ? own : origin.range;
    if (!told_.emplace(place.begin, place.end).second) return;  // a fixed value is also part of a correction
    elaboration_.sink.report(
        "on-pole", place, {},
        "take fields at cell centres, and derivatives of derivatives as lap(u) or div(k*grad(u)), or let the axis end "
        "before the pole, or leave out all cells that read it by an `if` of the coordinate and numbers");
  }

  Elaboration& elaboration_;
  Placements placements_;
  Divisions divisions_;
  std::size_t axis_;
  std::set<std::pair<int, int>> told_;  // reported positions
};

}  // namespace

void check_pole_places(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  // of an axis of symmetry, as that of a cylinder
  const auto has_no_way_around = [&](std::size_t axis, bool is_low) {
    return problem.metric && depends_on_axis(problem.metric->around, static_cast<int>(axis)) &&
           vanishes_at(problem, problem.metric->around, axis, is_low);
  };
  for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) {
    for (const bool is_low : {true, false}) {
      if (is_pole_at(problem, axis, is_low) || has_no_way_around(axis, is_low))
        PolePlaces(elaboration, axis, is_low).check();
    }
  }
}

bool is_on_pole(const Problem& problem, const Expr& e) {
  const std::optional<Placement> place = Placements(problem).natural(e);
  for (std::size_t axis = 0; place && axis < problem.axes.size(); ++axis) {
    if ((*place)[axis] && (is_pole_at(problem, axis, true) || is_pole_at(problem, axis, false))) return true;
  }
  return false;
}

}  // namespace dpde::model
