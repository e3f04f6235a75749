// SPDX-License-Identifier: Apache-2.0
// Warns if differences and means across a periodic boundary read a coordinate, which jumps there: dy(beta*y) is beta in
// all rows except next to the boundary.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "model/analyse/formula.h"
#include "model/build.h"
#include "model/from_ast/names/known_values.h"
#include "model/from_ast/parts.h"
#include "model/uses.h"
#include "network/network.h"

namespace dpde::model {

namespace {

/// Call of an operator with a given adjoint, while its body is checked: the arguments by name, and the position of the
/// call.
struct Arguments {
  const Apply& apply;
  const Origin& use;
  const Arguments* outer;
};

/// Replaces fields and everything else without a formula by arbitrary uniform numbers, so that formulas contain only
/// coordinates.
class StandIns {
 public:
  explicit StandIns(const Elaboration& elaboration) : elaboration_(elaboration) {}

  /// Across the periodic boundary of an axis.
  Expr formula_of(const Expr& e, int axis, const Arguments* arguments) {
    const auto same = [&](const Expr& part) { return formula_of(part, axis, arguments); };
    if (is<Number, Coordinate>(e)) return e;
    if (const auto* param = as<Param>(e)) return value_of(param->name);
    if (const auto* field = as<Field>(e)) return field_of(field->name, axis, arguments);
    if (const auto* neg = as<Neg>(e)) return negate(same(neg->operand));
    if (const auto* b = as<Binary>(e)) return binary(b->op, same(b->left), same(b->right));
    if (const auto* s = as<Select>(e)) return select(same(s->condition), same(s->yes), same(s->no));
    if (const auto* c = as<Call>(e)) {
      std::vector<Expr> parts;
      for (const Expr& argument : c->arguments) parts.push_back(same(argument));
      return call(c->fn, std::move(parts));
    }
    if (const auto* shift = as<Shift>(e)) return same(shift->operand);
    if (const auto* here = as<Interpolate>(e)) return same(here->operand);
    if (const auto* reduce = as<Reduce>(e); reduce && !reduce->over[static_cast<std::size_t>(axis)])
      return same(reduce->operand);
    if (const auto* apply = as<Apply>(e)) {
      const Arguments inner{*apply, e->origin, arguments};
      return formula_of(apply->function.body[static_cast<std::size_t>(apply->component)], axis, &inner);
    }
    if (const auto* d = as<Derivative>(e); d != nullptr && d->axis != axis) return slope(*d, same(d->operand));
    return some_number(std::to_string(others_++));
  }

 private:
  /// The derivative along another axis. If the operand has a field, so has its derivative, and any number will do.
  static Expr slope(const Derivative& d, Expr formula) {
    const bool has_field = holds_any<Field>(d.operand);
    for (int i = 0; i < d.order && !has_field; ++i) formula = slope_of(formula, {d.axis});
    return formula;
  }

  Expr value_of(const std::string& param) {
    const auto found = elaboration_.params.values.find(param);
    const bool is_known = found != elaboration_.params.values.end() && found->second;
    return is_known && (*found->second != 0 || !elaboration_.params.unknowns.contains(param)) ? Expr(*found->second)
                                                                                              : some_number(param);
  }

  Expr field_of(const std::string& name, int axis, const Arguments* arguments) {
    if (arguments != nullptr) {
      const std::vector<std::string>& names = arguments->apply.function.parameters;
      const auto found = std::ranges::find(names, name);
      return found == names.end()
                 ? some_number(name)
                 : formula_of(arguments->apply.arguments[static_cast<std::size_t>(found - names.begin())], axis,
                              arguments->outer);
    }
    const Coefficient* coefficient = elaboration_.problem.find_coefficient(name);
    const bool has_formula = coefficient != nullptr && coefficient->value.formula;
    return has_formula ? formula_of(*coefficient->value.formula, axis, nullptr) : some_number(name);
  }

  /// A different number for each name, so that they do not cancel.
  Expr some_number(const std::string& name) {
    const auto next = static_cast<double>(numbers_.size());
    return numbers_.emplace(name, 0.7316 + 0.3717 * next).first->second;
  }

  const Elaboration& elaboration_;
  std::map<std::string, double> numbers_;
  int others_ = 0;
};

/// Whether a formula differs between the two ends of a periodic axis. If it is as steep inside, it is rough on purpose:
/// masks, layers.
bool jumps(const Expr& formula, const std::vector<Axis>& axes, std::size_t axis, double beside) {
  constexpr int places = 2048;
  constexpr double least = 1e-3, rounding = 1e-12, end = 1e-9;
  std::array<double, 3> place{};
  for (std::size_t a = 0; a < axes.size(); ++a) place[a] = axes[a].low + beside * (axes[a].high - axes[a].low);
  const auto at = [&](double part) {
    place[axis] = axes[axis].low + part * (axes[axis].high - axes[axis].low);
    return value_at(formula, place);
  };
  const double first = at(end), last = at(1 - end), jump = std::abs(last - first);
  if (!(jump > rounding * std::max(std::abs(first), std::abs(last)))) return false;
  double low = first, high = first, before = first, steepest = 0;
  for (int i = 1; i <= places; ++i) {
    const double value = i == places ? last : at(static_cast<double>(i) / places);
    if (!std::isfinite(value)) return false;
    low = std::min(low, value), high = std::max(high, value);
    steepest = std::max(steepest, std::abs(value - before));
    before = value;
  }
  return jump > least * (high - low) && jump > 2 * steepest;
}

class Seams {
 public:
  explicit Seams(Elaboration& elaboration) : elaboration_(elaboration), stand_ins_(elaboration) {}

  void check() {
    const Placements placements(elaboration_.problem);
    for_each_formula(elaboration_.problem, [&](const Use& use) {
      if (!is_of_states(use.kind)) return;  // the others contain no differences
      origin_ = use.origin;
      walk(use.formula, {placements, nullptr}, use.home);
    });
  }

 private:
  /// Context of an expression: in an operator its arguments have other placements.
  struct Inside {
    const Placements& placements;
    const Arguments* arguments;
  };

  void walk(const Expr& e, const Inside& inside, const Placement& wanted) {
    const auto go_on = [&](const Expr& part, const Placement& place) { walk(part, inside, place); };
    if (const auto* d = as<Derivative>(e)) {
      look(d->operand, d->axis, inside, e->origin);
      const Placement between = toggled(wanted, d->axis);
      const bool is_between =
          inside.placements.is_staggered() && d->order == 1 && inside.placements.can_be_at(d->operand, between);
      return go_on(d->operand, is_between ? between : wanted);
    }
    if (const auto* here = as<Interpolate>(e)) {
      look_between(here->operand, inside, wanted, e->origin);
      return go_on(here->operand, inside.placements.natural(here->operand).value_or(wanted));
    }
    if (const auto* reduce = as<Reduce>(e))
      return go_on(reduce->operand, inside.placements.operand_placement(*reduce, wanted).value_or(Placement{}));
    if (const auto* apply = as<Apply>(e)) return walk_operator(*apply, inside, wanted, e->origin);
    if (const auto* at = as<Sample>(e)) return look_beside(*at, inside, e->origin);
    if (const auto* solve = as<Solve>(e)) {
      go_on(solve->operation, {});
      for (const Expr& start : solve->starts) go_on(start, {});
      if (solve->preconditioner) go_on(*solve->preconditioner, {});
      return go_on(solve->right, {});
    }
    look_around(e, inside, wanted);
    if (const auto* call = as<NetworkCall>(e)) {
      const Placements::OfCall places = inside.placements.places_of(*call, wanted);
      for (std::size_t i = 0; i < call->arguments.size(); ++i) go_on(call->arguments[i], places.arguments[i]);
      return;
    }
    for_each_child(e, [&](const Expr& part) { go_on(part, wanted); });
  }

  /// Expressions that read neighbours along several axes.
  void look_around(const Expr& e, const Inside& inside, const Placement& wanted) {
    const auto* advect = as<Advect>(e);
    const auto* shift = as<Shift>(e);
    const bool is_place = shift != nullptr && is<Coordinate>(shift->operand);
    if (is_place) return;  // the coordinate of the neighbour itself, as in inject, which handles the periodic boundary
    const auto* inference = as<NetworkCall>(e);
    const network::Network* network = inference != nullptr ? network_of(inference->network) : nullptr;
    for (int axis = 0; axis < static_cast<int>(elaboration_.problem.axes.size()); ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      if (advect != nullptr && !is_literal(advect->velocity[a], 0)) look(advect->operand, axis, inside, e->origin);
      if (shift != nullptr && shift->offset[a] != 0) look(shift->operand, axis, inside, e->origin);
      if (network == nullptr || network->is_host() || is_pointwise(*network)) continue;
      for (const Expr& argument : inference->arguments) look(argument, axis, inside, e->origin);
    }
    if (advect == nullptr) return;
    for (const Expr& velocity : advect->velocity) look_between(velocity, inside, wanted, e->origin);
  }

  const network::Network* network_of(const std::string& name) const {
    const DeclaredNetwork* declared = find_network(elaboration_, name);
    return declared != nullptr && declared->network ? &*declared->network : nullptr;
  }

  /// Averages from their own placement to the required one.
  void look_between(const Expr& e, const Inside& inside, const Placement& wanted, const Origin& origin) {
    const std::optional<Placement> own = inside.placements.natural(e);
    for (std::size_t axis = 0; own && axis < elaboration_.problem.axes.size(); ++axis) {
      if ((*own)[axis] != wanted[axis]) look(e, static_cast<int>(axis), inside, origin);
    }
  }

  /// Values between the last point of an axis and the first.
  void look_beside(const Sample& sample, const Inside& inside, const Origin& origin) {
    const std::vector<Axis> axes = axes_at(elaboration_.problem.axes, inside.placements.of(sample.field));
    for (std::size_t axis = 0; axis < sample.place.size(); ++axis) {
      const std::optional<double> at = known_value(sample.place[axis], elaboration_.params.values);
      const Axis& along = axes[axis];
      const double first = along.centre(0), last = along.centre(along.cells - 1);
      if (at && (*at < std::min(first, last) || *at > std::max(first, last)))
        look(field(sample.field), static_cast<int>(axis), inside, origin);
    }
  }

  void walk_operator(const Apply& apply, const Inside& inside, const Placement& wanted, const Origin& use) {
    const Arguments arguments{apply, inside.arguments != nullptr ? inside.arguments->use : use, inside.arguments};
    const Placements placements = inside.placements.inside(apply, wanted);
    walk(apply.function.body[static_cast<std::size_t>(apply.component)], {placements, &arguments}, wanted);
    for (const Expr& argument : apply.arguments)
      walk(argument, inside, inside.placements.natural(argument).value_or(Placement{}));
  }

  void look(const Expr& operand, int axis, const Inside& inside, const Origin& read) {
    const Origin& origin = inside.arguments != nullptr ? inside.arguments->use : read;
    const std::vector<Axis>& axes = elaboration_.problem.axes;
    if (axes[static_cast<std::size_t>(axis)].topology != Topology::periodic) return;
    const SourceRange range = origin.range.is_known() ? origin.range : origin_.range;
    if (told_.contains({range.begin, range.end})) return;
    const Expr formula = stand_ins_.formula_of(operand, axis, inside.arguments);
    if (!depends_on_axis(formula, axis)) return;
    const bool does_jump = std::ranges::any_of(std::array{0.31, 0.57, 0.83}, [&](double beside) {
      return jumps(formula, axes, static_cast<std::size_t>(axis), beside);
    });
    if (!does_jump) return;
    told_.insert({range.begin, range.end});
    const std::string name = written_axis(elaboration_, static_cast<std::size_t>(axis));
    elaboration_.sink.report("jump-at-seam", range, {name},
                             "write the derivative of the formula by hand, as -bracket(psi, q) - beta*dx(psi) for "
                             "-bracket(psi, q + beta*y), or give " +
                                 name + " walls, or take a formula that is periodic");
  }

  Elaboration& elaboration_;
  StandIns stand_ins_;
  Origin origin_;
  std::set<std::pair<int, int>> told_;  // reported positions
};

}  // namespace

void check_seams(Elaboration& elaboration) {
  const auto is_periodic = [](const Axis& axis) { return axis.topology == Topology::periodic; };
  if (std::ranges::any_of(elaboration.problem.axes, is_periodic)) Seams(elaboration).check();
}

}  // namespace dpde::model
