// SPDX-License-Identifier: Apache-2.0
#include "stencil/lower/walls.h"

#include <algorithm>
#include <optional>

#include "model/boundary/wall_coefficient.h"
#include "model/boundary/wall_formula.h"
#include "model/build.h"
#include "stencil/build.h"
#include "stencil/passes/place_fills.h"

namespace dpde::stencil {

namespace {

Expr lowered(const model::Expr& value, const Expr& time, const model::Placement& placement,
             const FieldsOfStates& at = {}) {
  Environment reading;
  reading.time = time;
  reading.fields = at;
  return Discretiser(model::Scheme{}, NameSupply(), 1, reading)(value, placement);
}

/// `e` with the coordinate along the axis replaced by that of the wall.
Expr at_wall(const Expr& e, const std::string& coordinate, double wall) {
  const Access* read = as<Access>(e);
  if (read && read->field == coordinate) return wall;
  return map_children(e, [&](const Expr& part) { return at_wall(part, coordinate, wall); });
}

/// The value c of a side, as a formula of states and coefficients at the point of evaluation. `at`: the fields that
/// replace states.
Expr side_value(const model::State& state, const model::Problem& problem, int axis, bool is_low, const Expr& time,
                const FieldsOfStates& at = {}) {
  const model::Side& from = is_low ? state.boundary[axis].low : state.boundary[axis].high;
  const double wall = is_low ? problem.axes[axis].low : problem.axes[axis].high;
  model::Placement along = state.placement;  // across the wall there is no half-cell shift
  along[static_cast<std::size_t>(axis)] = false;
  return at_wall(lowered(from.value, time, along, at), axis_letter(axis), wall);
}

/// Whether the field is extrapolated linearly to the wall from the two cells next to it.
bool is_led_to_walls(const std::string& field, const model::Problem& problem, int axis, const FieldsOfStates& at) {
  const auto index = static_cast<std::size_t>(axis);
  const auto is_read = [&](const model::State& state) {
    const auto found = at.find(state.name);
    return !state.placement[index] && field == (found == at.end() ? state.name : found->second);
  };
  const model::Coefficient* coefficient = problem.find_coefficient(field);
  return std::ranges::any_of(problem.states, is_read) ||
         (coefficient && model::is_led_to_walls(problem, *coefficient, index));
}

/// A formula in the cell next to the side, with fields extrapolated to the wall: (3u - w)/2 with u in this cell and w
/// in the next one inside, u if there is one cell. Fields that lie on the wall are read as they are.
Expr led_to_wall(const Expr& e, const model::Problem& problem, int axis, bool is_low, const FieldsOfStates& at = {}) {
  const Access* read = as<Access>(e);
  if (!read || !is_led_to_walls(read->field, problem, axis, at))
    return map_children(e, [&](const Expr& part) { return led_to_wall(part, problem, axis, is_low, at); });
  Offset inwards{}, behind = read->offset;
  inwards[axis] = is_low ? 1 : -1;
  behind[axis] += inwards[axis];
  return select(inside(inwards, 0), 1.5 * e - 0.5 * access(read->field, behind), e);
}

/// Whether a side's value is computed in the cell next to it, from fields extrapolated to the wall. Rates and wave
/// speeds are those in that cell.
bool is_made_beside(const model::Side& side, const model::Problem& problem, int axis) {
  if (model::is_of_states(problem, side)) return true;
  return !condition_of(side.kind).takes_rate() && any_part(side.value, [&](const model::Expr& part) {
    const auto* field = as<model::Field>(part);
    return field && is_led_to_walls(field->name, problem, axis, {});
  });
}

/// For radiating conditions, the gradient mirrored about the cell that has the rate.
SideKind kind_of_fill(const model::Side& side) {
  return condition_of(side.kind).takes_rate() ? SideKind::gradient_at_cell : side.kind;
}

SourceRange around(const SourceRange& a, const SourceRange& b) {
  if (!a.is_known() || !b.is_known()) return a.is_known() ? a : b;
  return {std::min(a.begin, b.begin), std::max(a.end, b.end)};
}

bool is_on_walls(const model::State& state, const model::Problem& problem, int axis) {
  return state.placement[static_cast<std::size_t>(axis)] && problem.axes[axis].topology == Topology::bounded;
}

}  // namespace

Expr with_wall_value(const model::State& state, const model::Problem& problem, const Expr& value, const Expr& time) {
  Expr result = value;
  for (int axis = 0; axis < static_cast<int>(problem.axes.size()); ++axis) {
    if (!is_on_walls(state, problem, axis) || !condition_of(state.boundary[axis].high.kind).gives_value()) continue;
    Offset next{};
    next[axis] = 1;
    const Expr value = side_value(state, problem, axis, false, time);
    result = select(inside(next, 0), result, led_to_wall(value, problem, axis, false));
  }
  return result;
}

bool is_derived_on_wall(const model::State& state, const model::Problem& problem) {
  for (int axis = 0; axis < static_cast<int>(problem.axes.size()); ++axis) {
    const SideCondition& high = condition_of(state.boundary[axis].high.kind);
    if (is_on_walls(state, problem, axis) && !high.gives_value() && !high.keeps_wall()) return true;
  }
  return false;
}

std::vector<Offset> known_on_walls(const model::State& state, const model::Problem& problem) {
  std::vector<Offset> next;
  for (int axis = 0; axis < static_cast<int>(problem.axes.size()); ++axis) {
    if (is_on_walls(state, problem, axis) && !condition_of(state.boundary[axis].high.kind).keeps_wall())
      next.emplace_back()[axis] = 1;
  }
  return next;
}

bool Walls::varies(const model::Expr& value) const {
  return any_part(value, [&](const model::Expr& part) {
    const auto* param = as<model::Param>(part);
    const model::Parameter* known = param ? problem_.find_param(param->name) : nullptr;
    const bool is_control = param && problem_.find_control(param->name) !=
                                         nullptr;  // a halo filled one step earlier would have its last value
    return is<model::Coordinate, model::Field>(part) || (known && known->unknown) || is_control;
  });
}

/// The field with dt(u).
std::string Walls::rate_field(const model::State& state, const FieldsOfStates& at) const {
  const std::string& rate = problem_.velocity_of(state.name)->name;
  const auto found = at.find(rate);
  return found == at.end() ? rate : found->second;
}

/// The field with dt(u), with a rule for its halo.
std::string Walls::filled_rate(const model::State& state, const Expr& time, Module& module, Program& program,
                               const FieldsOfStates& at) {
  const std::string field = rate_field(state, at);
  if (!has_rule(program.halos, field))
    program.halos.push_back(
        rule_of_fill({field, boundary(*problem_.velocity_of(state.name), time, module, program, at)}));
  return field;
}

/// Across the side the rule `line` with factor 0 copies the nearest cell's value to all halo cells. Along the side it
/// extrapolates linearly, also beyond corners.
Expr Walls::from_beside(const model::State& state, int axis, bool is_low, const Expr& time, Module& module,
                        Program& program, const FieldsOfStates& at) {
  const model::Side& from = is_low ? state.boundary[axis].low : state.boundary[axis].high;
  const Expr here = side_value(state, problem_, axis, is_low, time, at);
  const Expr value = condition_of(from.kind).takes_rate() ? -access(rate_field(state, at)) / here
                                                          : led_to_wall(here, problem_, axis, is_low, at);
  const std::string field = stored(state.name, value, from.value->origin, 0, module, program);
  std::vector<AxisBoundary> beyond;
  for (const model::Axis& along : problem_.axes) {
    const Side side{SideKind::line, 0.0, static_cast<int>(beyond.size()) == axis ? 0.0 : 1.0};
    beyond.push_back({along.topology, side, side});
  }
  if (!has_rule(program.halos, field)) program.halos.push_back(rule_of_fill({field, std::move(beyond)}));
  return access(field);
}

std::vector<AxisBoundary> Walls::boundary(const model::State& state, const Expr& time, Module& module, Program& program,
                                          const FieldsOfStates& at) {
  std::vector<AxisBoundary> boundary;
  std::vector<std::pair<int, bool>> varying;  // sides, as axis and whether it is the low one
  std::optional<Expr> value;                  // at each halo cell the value for the axis that is filled last
  SourceRange origin;                         // covers all its parts
  for (int axis = 0; axis < static_cast<int>(problem_.axes.size()); ++axis) {
    boundary.push_back({problem_.axes[axis].topology, {}, {}});
    if (boundary.back().topology == Topology::periodic) continue;
    for (const bool is_low : {true, false}) {
      const model::Side& from = is_low ? state.boundary[axis].low : state.boundary[axis].high;
      const double wall = is_low ? problem_.axes[axis].low : problem_.axes[axis].high;
      const bool on_walls = is_on_walls(state, problem_, axis);
      Side& side = is_low ? boundary.back().low : boundary.back().high;
      if (is_made_beside(from, problem_, axis)) {
        const Expr c = from_beside(state, axis, is_low, time, module, program, at);
        side = {kind_of_fill(from), c, lowered(from.a, time, {}), lowered(from.b, time, {}), on_walls};
        continue;
      }
      Expr c = side_value(state, problem_, axis, is_low, time);
      const bool takes_rate = condition_of(from.kind).takes_rate();
      if (takes_rate) c = -access(filled_rate(state, time, module, program, at)) / c;
      side = {kind_of_fill(from), c, lowered(from.a, time, {}), lowered(from.b, time, {}), on_walls};
      if (!takes_rate && !varies(from.value)) continue;
      // the points on the high wall belong to the last cells
      const Expr last = on_walls && !is_low ? Expr(wall) - spacing(axis) : Expr(wall);
      const Expr beyond = binary(is_low ? BinaryOp::less : BinaryOp::greater, access(axis_letter(axis)), last);
      value = value ? select(beyond, c, *value) : c;
      origin = around(origin, from.value->origin.range);
      varying.emplace_back(axis, is_low);
    }
  }
  if (!value) return boundary;
  const std::string field = stored(state.name, *value, {origin}, width_, module, program);
  for (const auto& [axis, is_low] : varying) (is_low ? boundary[axis].low : boundary[axis].high).value = access(field);
  return boundary;
}

/// The field with `value` on the halo; fills with equal values share one field.
std::string Walls::stored(const std::string& state, const Expr& value, const Origin& origin, int grow, Module& module,
                          Program& program) {
  const auto same = [&](const auto& known) { return known.first == value; };
  const auto found = std::find_if(stored_.begin(), stored_.end(), same);
  if (found != stored_.end()) return found->second;
  const std::string field = names_.fresh(state + "_wall");
  Kernel kernel;
  kernel.name = without_dots(program.name + "_" + field);
  kernel.rank = static_cast<int>(problem_.axes.size());
  kernel.stores.push_back({field, false, value, origin});
  for (const Signature::Read& read : signature(kernel).reads) {
    const bool is_beyond = grow > 0 || *std::ranges::max_element(read.halo) > 0;
    const bool is_coefficient = problem_.find_coefficient(read.field) != nullptr;
    if (is_beyond && is_coefficient && !has_rule(program.halos, read.field))
      program.halos.push_back(rule_of_fill({read.field, boundary_of_(read.field)}));
  }
  program.body.push_back(Run{add_kernel(module, std::move(kernel)), grow});
  stored_.emplace_back(value, field);
  return field;
}

}  // namespace dpde::stencil
