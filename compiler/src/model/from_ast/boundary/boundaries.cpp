// SPDX-License-Identifier: Apache-2.0
// Conditions at the sides of bounded axes, for each field.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "model/boundary/metric.h"
#include "model/boundary/wall_formula.h"
#include "model/build.h"
#include "model/from_ast/formulas/built_ins.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// The sides that a name selects: [axis][low, high].
struct NamedSides {
  int axis = -1;  // -1: all
  bool low = true, high = true;
};

std::optional<NamedSides> find_place(Elaboration& elaboration, const ast::Identifier& place) {
  if (!elaboration.problem.has_grid) {
    report_no_grid(elaboration, "a boundary", place.range);
    return std::nullopt;
  }
  if (place.name == "all") return NamedSides{};
  const std::size_t dot = place.name.find('.');
  const std::string side = dot == std::string::npos ? "" : place.name.substr(dot + 1);
  const int axis = axis_of(elaboration, place.name.substr(0, dot));
  if (axis >= 0 && axis < static_cast<int>(elaboration.problem.axes.size()))
    return NamedSides{axis, side != "high", side != "low"};
  std::vector<std::string> sides{"all"};
  for (const Axis& known : elaboration.problem.axes) {
    for (const char* end : {"", ".low", ".high"}) sides.push_back(known.name + end);
  }
  elaboration.sink.report("unknown-side", place.range, {place.name}, did_you_mean(place.name, sides));
  return std::nullopt;
}

/// A number or a parameter with value 0.
bool is_zero(const Elaboration& elaboration, const Expr& e) {
  const auto* param = as<Param>(e);
  const auto found = param ? elaboration.params.values.find(param->name) : elaboration.params.values.end();
  return is_literal(e, 0) || (found != elaboration.params.values.end() && found->second && *found->second == 0);
}

/// Whether the call has `count` unnamed arguments.
bool takes(Elaboration& elaboration, const ast::Call& call, std::size_t count, const std::string& usage) {
  bool plain = call.arguments.size() == count;
  for (const ast::Argument& argument : call.arguments) plain = plain && argument.name.empty();
  if (plain) return true;
  elaboration.sink.report(
      "wrong-argument-count", call.callee_range,
      {call.callee, counted(static_cast<int>(count), "argument"), std::to_string(call.arguments.size())}, usage);
  return false;
}

/// Reads u = ..., or WORD or WORD(...) of side_conditions.h.
std::optional<Side> condition_side(Elaboration& elaboration, const SideCondition& condition, const ast::Call& call,
                                   const std::string& field) {
  Side side{condition.kind};
  const std::vector<Expr*> parts = given_parts(side);
  const std::string usage = fmt::format("write {}", condition.usage);
  if (!takes(elaboration, call, parts.size(), usage)) return std::nullopt;
  bool good = true;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const FormulaContext context = parts[i] == &side.value ? FormulaContext::boundary : FormulaContext::boundary_weight;
    const auto part = formulas::number({elaboration, context, field}, call.arguments[i].value);
    if (part) *parts[i] = *part;
    good = good && part;
  }
  if (!good) return std::nullopt;
  if (condition.b == SideCondition::Part::given && is_zero(elaboration, side.a) && is_zero(elaboration, side.b)) {
    elaboration.sink.report("empty-condition", call.callee_range, {field}, usage);
    return std::nullopt;
  }
  return side;
}

std::optional<Side> side_of(Elaboration& elaboration, const ast::Expr& value, const std::string& field) {
  const auto* word = std::get_if<ast::Name>(&value->kind);
  const SideCondition* named = word ? find_condition(word->name, SideCondition::Level::models) : nullptr;
  if (named && named->is_word_alone()) return Side{named->kind};
  if (word && word->name == "periodic") {
    elaboration.sink.report("not-allowed-here", value.range(), {"periodic", "a boundary"},
                            "write it in the grid line: grid x = 0 .. 1, cells 128, periodic");
    return std::nullopt;
  }
  const auto* call = std::get_if<ast::Call>(&value->kind);
  const SideCondition* called = call ? find_condition(call->callee, SideCondition::Level::models) : nullptr;
  if (called && !(called->is_word_alone() && call->arguments.empty()))
    return condition_side(elaboration, *called, *call, field);
  if (call && call->callee == "on_wall") {
    elaboration.sink.report("not-allowed-here", call->callee_range, {"on_wall", "the boundary of a scene"},
                            "in a model, field u on faces.x says that u lies on the walls; write its condition alone");
    return std::nullopt;
  }
  const auto number = formulas::number({elaboration, FormulaContext::boundary, field}, value);
  return number ? std::optional(Side{SideKind::value, *number}) : std::nullopt;
}

/// Marks one side as given; false if it was given before.
bool mark(Elaboration& elaboration, const ast::BoundarySide& side, const std::string& name, SourceRange& seen,
          const std::string& field) {
  if (seen.is_known()) {
    report_duplicate(elaboration, fmt::format("the boundary of {} at {}", field, name), side.place.range, seen);
    return false;
  }
  seen = side.place.range;
  return true;
}

bool is_periodic(const Axis& axis) { return axis.topology == Topology::periodic; }

void check_not_periodic(Elaboration& elaboration, const ast::BoundarySide& side, const NamedSides& place) {
  std::vector<std::string> periodic;
  bool any_bounded = false;
  for (int axis = 0; axis < static_cast<int>(elaboration.problem.axes.size()); ++axis) {
    if (place.axis >= 0 && place.axis != axis) continue;
    if (is_periodic(elaboration.problem.axes[axis])) periodic.push_back(written_axis(elaboration, axis));
    any_bounded = any_bounded || !is_periodic(elaboration.problem.axes[axis]);
  }
  if (any_bounded) return;
  elaboration.sink.report("boundary-of-periodic-axis", side.place.range, {fmt::format("{}", fmt::join(periodic, ", "))},
                          "leave this out, or periodic in the grid line");
}

/// "x", "x.low", ... of the sides without a condition, except poles (check_poles).
std::vector<std::string> missing_sides(const Elaboration& elaboration,
                                       const std::vector<std::array<SourceRange, 2>>& seen) {
  std::vector<std::string> missing;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (is_periodic(elaboration.problem.axes[i])) continue;
    const bool low = seen[i][0].is_known() || is_pole_at(elaboration.problem, i, true);
    const bool high = seen[i][1].is_known() || is_pole_at(elaboration.problem, i, false);
    const std::string axis = written_axis(elaboration, i);
    if (!low && !high) missing.push_back(axis);
    if (low != high) missing.push_back(axis + (low ? ".high" : ".low"));
  }
  return missing;
}

void check_complete(Elaboration& elaboration, const State& state, const std::vector<std::array<SourceRange, 2>>& seen) {
  const std::vector<std::string> missing = missing_sides(elaboration, seen);
  if (missing.empty()) return;
  SourceRange range = elaboration.blocks.scene->name.range;
  for (const auto& [grid, item] : items_of<ast::GridItem>(elaboration.blocks.scene->items)) {
    if (grid.axis.name == missing.front().substr(0, missing.front().find('.'))) range = grid.axis.range;
  }
  elaboration.sink.report("missing-boundary", range, {state.name, fmt::format("{}", fmt::join(missing, ", "))},
                          fmt::format("write boundary {}: {} = 0, or = zero_gradient; or periodic in the grid line",
                                      state.name, fmt::join(missing, " = 0, ")));
}

/// Whether a condition contains t or fields.
bool holds_time(const Problem& problem, const std::vector<AxisSides>& boundary) {
  if (has_wall_formula(problem, boundary)) return true;
  const auto is_time = [](const Expr& part) {
    const auto* param = as<Param>(part);
    return param && param->name == "t";
  };
  return std::any_of(boundary.begin(), boundary.end(), [&](const AxisSides& sides) {
    for (const Expr* e :
         {&sides.low.value, &sides.low.a, &sides.low.b, &sides.high.value, &sides.high.a, &sides.high.b}) {
      if (any_part(*e, is_time)) return true;
    }
    return false;
  });
}

/// Whether an equation has a spatial derivative of an expression with the field.
bool reads_around(const Problem& problem, const std::string& field) {
  const auto is_field = [&](const Expr& part) {
    const auto* read = as<Field>(part);
    return read && read->name == field;
  };
  return std::any_of(problem.states.begin(), problem.states.end(), [&](const State& state) {
    return state.rhs && any_part(*state.rhs, [&](const Expr& part) {
             const bool reads = is<Derivative, Advect, Interpolate>(part);
             return reads && any_part(part, is_field);
           });
  });
}

}  // namespace

std::optional<SourceRange> boundary_of_side(const Elaboration& elaboration, const std::string& state,
                                            const std::string& place) {
  for (const auto& [item, range] : items_of<ast::BoundaryItem>(elaboration.blocks.scene->items)) {
    const std::vector<std::string> components = components_of(elaboration, item.field.name);
    if (std::ranges::find(components, state) == components.end()) continue;
    for (const ast::BoundarySide& side : item.sides) {
      const std::size_t dot = std::min(side.place.name.find('.'), side.place.name.size());
      const int axis = axis_of(elaboration, side.place.name.substr(0, dot));
      const std::string name = axis < 0 ? side.place.name : axis_name(axis) + side.place.name.substr(dot);
      if (name == place || name == "all" || place.starts_with(name + ".")) return side.value.range();
    }
  }
  return std::nullopt;
}

namespace {

/// Refuses outflow at the wall where an axis begins: arrays of a staggered field have no value there.
void check_open_walls(Elaboration& elaboration, const State& state) {
  for (std::size_t axis = 0; axis < state.boundary.size(); ++axis) {
    const Axis& along = elaboration.problem.axes[axis];
    if (along.topology == Topology::periodic || !state.placement[axis]) continue;
    const bool is_low = !along.holds_wall(true);
    const AxisSides& sides = state.boundary[axis];
    const auto is_open = [](const Side& side) { return condition_of(side.kind).keeps_wall(); };
    if (!is_open(is_low ? sides.low : sides.high)) continue;
    const std::string place = along.name + (is_low ? ".low" : ".high");
    const bool are_both = is_open(sides.low) && is_open(sides.high);
    elaboration.sink.report(
        "not-allowed-here", boundary_of_side(elaboration, state.name, place).value_or(state.origin.range),
        {"outflow", fmt::format("{}, where the axis begins", place)},
        are_both ? fmt::format("one end of {} can be open: give {} a value at the other", along.name, state.name)
                 : fmt::format("let the axis end there: grid {} = {} .. {}; arrays then begin with the "
                               "cell at the other end, formulas stay",
                               along.name, is_low ? along.high : along.low, is_low ? along.low : along.high));
  }
}

/// dt(u) is 0 at sides where u has a value, and has zero slope where u has a slope. If the conditions of u vary in
/// time, spatial derivatives of dt(u) are refused.
void derive_velocity_boundaries(Elaboration& elaboration) {
  Problem& problem = elaboration.problem;
  for (State& state : problem.states) {
    const State* moved = problem.find_state(state.velocity_of);
    if (!moved) continue;
    const bool is_open = radiates(*moved);
    if ((is_open || holds_time(problem, moved->boundary)) && reads_around(problem, state.name)) {
      elaboration.sink.report("not-allowed-here", state.origin.range,
                              {is_open ? "radiating" : "a boundary with t or fields",
                               fmt::format("a scene that differentiates dt({}) in space", moved->name)},
                              "boundary values of dt(u) are not derived from those of u that vary in time");
    }
    state.boundary = moved->boundary;
    for (AxisSides& sides : state.boundary) {
      for (Side* side : {&sides.low, &sides.high}) {
        side->value = 0.0;
        // the slope follows from the time derivative in the cell next to the side
        if (condition_of(side->kind).takes_rate()) side->kind = SideKind::zero_gradient;
      }
    }
  }
}

}  // namespace

void bind_side(Elaboration& elaboration, const ast::BoundarySide& side, SidesOfField& into) {
  const auto place = find_place(elaboration, side.place);
  const auto value = side_of(elaboration, side.value, into.field);
  if (!place) return;
  check_not_periodic(elaboration, side, *place);
  for (int i = 0; i < static_cast<int>(elaboration.problem.axes.size()); ++i) {
    const Axis& axis = elaboration.problem.axes[i];
    if ((place->axis >= 0 && place->axis != i) || is_periodic(axis)) continue;
    const Side set = value.value_or(Side{});
    const auto* call = std::get_if<ast::Call>(&side.value->kind);
    if (condition_of(set.kind).b == SideCondition::Part::given)
      elaboration.weighted_sides.push_back({into.field, i,
                                            axis.name + (!place->high  ? ".low"
                                                         : !place->low ? ".high"
                                                                       : ""),
                                            set.a, set.b, call ? call->callee_range : side.place.range});
    const bool set_low = place->low && mark(elaboration, side, axis.name + ".low", into.seen[i][0], into.field);
    if (set_low) into.sides[i].low = set;
    // a single message if both sides were given before
    if (!place->high || (place->low && !set_low)) continue;
    if (mark(elaboration, side, axis.name + ".high", into.seen[i][1], into.field)) into.sides[i].high = set;
  }
}

namespace {

/// The side with its value replaced, as the error in it is already reported.
ast::BoundarySide poisoned(const ast::BoundarySide& side) { return {side.place, ast::Expr()}; }

/// Component of the vector that is the side's whole value; "" if it is not a vector.
std::string component_of(const Elaboration& elaboration, const ast::BoundarySide& side, std::size_t index) {
  const auto* word = std::get_if<ast::Name>(&side.value->kind);
  const Symbol* meaning = word ? elaboration.names.scope.find(word->name) : nullptr;
  const std::vector<std::string> names =
      meaning && meaning->is_vector ? components_of(elaboration, word->name) : std::vector<std::string>{};
  return index < names.size() ? names[index] : "";
}

/// The line's side for one component of a vector: the component of a tuple or of another vector. 0 and words such as
/// zero_gradient apply to all components.
ast::BoundarySide part_of(Elaboration& elaboration, const ast::BoundarySide& side, std::size_t index,
                          std::size_t count) {
  const std::string component = component_of(elaboration, side, index);
  if (!component.empty()) {
    const auto* whole = std::get_if<ast::Name>(&side.value->kind);
    elaboration.measures.note(side.value, {elaboration.measures.of_name(whole->name)});
    return {side.place, ast::Expr(ast::Node{ast::Name{component}, side.value.range()})};
  }
  const auto* tuple = std::get_if<ast::Tuple>(&side.value->kind);
  if (tuple && tuple->elements.size() == count) return {side.place, tuple->elements[index]};
  const auto* number = std::get_if<ast::Number>(&side.value->kind);
  const auto* word = std::get_if<ast::Name>(&side.value->kind);
  const auto* call = std::get_if<ast::Call>(&side.value->kind);
  const std::vector<std::string> functions = formulas::function_names();
  const bool is_kind = (word && !elaboration.names.scope.find(word->name)) ||
                       (call && std::find(functions.begin(), functions.end(), call->callee) == functions.end());
  if (count == 1 || is_kind || (number && number->value == 0)) return side;
  elaboration.sink.report(
      "wrong-length", side.value.range(),
      {counted(static_cast<int>(count), "component"), std::to_string(tuple ? tuple->elements.size() : 1)},
      count == 2 ? "write (a, b), or boundary u.x: ... for one component"
                 : "write (a, b, c), or boundary u.x: ... for one component");
  return poisoned(side);
}

}  // namespace

std::vector<AxisSides> boundary_of_solved(Elaboration& elaboration, const std::string& name) {
  State unknown;
  unknown.name = name;
  unknown.boundary.resize(elaboration.problem.axes.size());
  std::vector<std::array<SourceRange, 2>> seen(elaboration.problem.axes.size());
  for (const auto& [item, range] : items_of<ast::BoundaryItem>(elaboration.blocks.scene->items)) {
    if (item.field.name != name) continue;
    SidesOfField into{name, unknown.boundary, seen};
    for (const ast::BoundarySide& side : item.sides) bind_side(elaboration, side, into);
  }
  check_complete(elaboration, unknown, seen);
  check_radiating(elaboration, unknown);
  measure_sides(elaboration, name, unknown.boundary);
  return unknown.boundary;
}

void bind_boundaries(Elaboration& elaboration) {
  std::map<std::string, std::vector<std::array<SourceRange, 2>>> seen;
  for (State& state : elaboration.problem.states) {
    state.boundary.resize(elaboration.problem.axes.size());
    seen[state.name].resize(elaboration.problem.axes.size());
  }
  for (const auto& [item, range] : items_of<ast::BoundaryItem>(elaboration.blocks.scene->items)) {
    if (elaboration.solves.solved.contains(item.field.name)) continue;
    if (elaboration.solves.multipliers.contains(item.field.name)) {
      elaboration.sink.report(
          "not-allowed-here", item.field.range, {"a boundary", "a field that a constraint gives"},
          fmt::format("that of {} follows from the fields that the constraint binds", item.field.name));
      continue;
    }
    const std::vector<State*> states = find_states(elaboration, item.field, "a boundary");
    if (!states.empty() && !states.front()->velocity_of.empty()) {
      elaboration.sink.report(
          "not-allowed-here", item.field.range, {item.field.name, "a boundary"},
          fmt::format("the boundary of dt({0}) follows from that of {0}", states.front()->velocity_of));
      continue;
    }
    for (const ast::BoundarySide& side : item.sides) {
      const std::size_t before = elaboration.sink.all().size();
      for (std::size_t i = 0; i < states.size(); ++i) {
        SidesOfField into{states[i]->name, states[i]->boundary, seen[states[i]->name]};
        const bool failed = elaboration.sink.all().size() != before;  // reported once, not for each component
        const bool is_whole = states[i]->name != item.field.name;
        bind_side(elaboration,
                  failed     ? poisoned(side)
                  : is_whole ? part_of(elaboration, side, i, states.size())
                             : side,
                  into);
      }
    }
  }
  for (const State& state : elaboration.problem.states) {
    const bool is_given = state.velocity_of.empty() && !elaboration.solves.multipliers.contains(state.name);
    if (is_given) check_complete(elaboration, state, seen[state.name]);
    check_open_walls(elaboration, state);
  }
  derive_velocity_boundaries(elaboration);
  for (State& state : elaboration.problem.states) measure_sides(elaboration, state.name, state.boundary);
  check_poles(elaboration);
}

}  // namespace dpde::model
