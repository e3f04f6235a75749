// SPDX-License-Identifier: Apache-2.0
// Functions and operators of the file, expanded at each call. A body can use its parameters, coordinates, t and pi; an
// operator's also spacings and neighbours of its parameters.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"

namespace dpde::model {

namespace {

constexpr int max_expansions = 20000;
constexpr int max_offset = 64;

/// "f -> g -> f", or "" if `function` is not being expanded already.
std::string cycle_to(const ast::Function& function, const FunctionScope* scope) {
  std::string path = function.name.name;
  for (; scope; scope = scope->outer) {
    path = scope->function.name.name + " -> " + path;
    if (&scope->function == &function) return path;
  }
  return "";
}

/// 0, 1, 2 for hx, hy, hz; -1 for other names.
int spacing_of(const std::string& name) { return name.size() == 2 && name[0] == 'h' ? axis_of(name.substr(1)) : -1; }

}  // namespace

namespace formulas {

namespace {

void note_order(FormulaScope& here, const FunctionScope& call, const TypedExpr& value);

TypedExpr body(FormulaScope& here, FunctionScope& scope, const ast::Call& e, SourceRange range) {
  const ast::Function& function = scope.function;
  if (!function.adjoints.empty() && !here.is_measuring) {
    const TypedExpr value = application(here, scope, e, range);
    if (value.type != TypedExpr::Type::none) note_order(here, scope, value);
    return value;
  }
  here.function = &scope;
  TypedExpr value = any(here, function.body);
  here.function = scope.outer;
  if (is_too_large(here, value, range)) return {};
  if (function.order && value.type != TypedExpr::Type::none) note_order(here, scope, value);
  return value;
}

/// Records the operator with independent fields as arguments, to measure its order. Its body was already checked. An
/// operator with a network or a solve is recorded as called: these are not measured.
void note_order(FormulaScope& here, const FunctionScope& call, const TypedExpr& value) {
  if (here.is_measuring) return;
  const ast::Function& function = call.function;
  const bool holds_network = std::any_of(value.parts.begin(), value.parts.end(),
                                         [](const Expr& part) { return holds_any<NetworkCall, Solve>(part); });
  FunctionScope scope{function, {}, here.function};
  for (const auto& [name, value] : call.arguments) {
    TypedExpr argument = value;
    for (std::size_t i = 0; i < argument.parts.size(); ++i) {
      if (is_uniform(argument.parts[i])) continue;
      const Expr own = field(fmt::format("argument {} {}", name, i));
      argument.parts[i] = argument.type == TypedExpr::Type::condition ? binary(BinaryOp::greater, own, 0.0) : own;
    }
    scope.arguments.emplace(name, std::move(argument));
  }
  const std::size_t dropped = here.elaboration.problem.remarks.dropped.size();
  here.is_measuring = true;
  here.function = &scope;
  const TypedExpr body = holds_network ? value : any(here, function.body);
  here.function = scope.outer;
  here.is_measuring = false;
  here.elaboration.problem.remarks.dropped.resize(dropped);
  const StatedOrder stated{function.name.name, *function.order, body.parts, here.is_of_step(), {function.name.range}};
  const bool is_known = std::any_of(here.elaboration.problem.operators.begin(),
                                    here.elaboration.problem.operators.end(), [&](const StatedOrder& other) {
                                      return other.name == stated.name && other.body == stated.body &&
                                             other.in_equations == stated.in_equations;
                                    });
  if (!is_known) here.elaboration.problem.operators.push_back(stated);
}

}  // namespace

TypedExpr user_call(FormulaScope& here, const ast::Function& function, const ast::Call& e, SourceRange range) {
  const bool is_equation = here.is_of_step() || here.context == FormulaContext::quantity;
  if (function.order && !is_equation) return refuse(here, "the operator " + e.callee, e.callee_range);
  const std::string cycle = cycle_to(function, here.function);
  if (!cycle.empty()) {
    here.elaboration.sink.report("recursive-function", e.callee_range, {e.callee, cycle},
                                 "functions are put in where they are called");
    return {};
  }
  if (!takes(here, e, static_cast<int>(function.parameters.size()))) return {};
  if (here.elaboration.names.expansions > max_expansions) return {};
  if (++here.elaboration.names.expansions > max_expansions) {
    here.elaboration.sink.report("too-large", range, {}, "call fewer functions inside one another");
    return {};
  }
  FunctionScope scope{function, {}, here.function};
  for (std::size_t i = 0; i < function.parameters.size(); ++i) {
    TypedExpr argument = measured(here, e.arguments[i].value);
    if (argument.type == TypedExpr::Type::none) return {};
    scope.arguments.emplace(function.parameters[i].name, std::move(argument));
  }
  const std::map<std::string, TypedExpr> running = std::exchange(here.variables, {});  // not visible in a body
  here.elaboration.measures.enter_call(e.callee_range);
  TypedExpr value = body(here, scope, e, range);
  value.unit = here.elaboration.measures.leave_call(function.body);
  here.variables = running;
  return value;
}

TypedExpr name_in_function(FormulaScope& here, const std::string& name, SourceRange range) {
  const auto argument = here.function->arguments.find(name);
  if (argument != here.function->arguments.end()) return argument->second;
  if (name == "identity") return identity(here);
  const std::string base = vector_of(name);
  const auto vector = here.function->arguments.find(base);
  if (vector != here.function->arguments.end() && vector->second.type == TypedExpr::Type::vector) {
    const int axis = axis_of(name.substr(base.size() + 1));
    if (axis < 0 || !has_axis(here, axis, range)) return {};
    return part_of(vector->second, axis);
  }
  if (vector != here.function->arguments.end() && vector->second.type == TypedExpr::Type::tensor)
    return tensor_component(here, vector->second, {name.substr(base.size() + 1), range});
  const int axis = here.function->function.order ? spacing_of(name) : -1;
  if (axis >= 0 && axis < here.axis_count() && here.elaboration.problem.axes[static_cast<std::size_t>(axis)].stretch) {
    here.elaboration.sink.report("on-stretched-axis", range, {"the spacing " + name, axis_name(axis)},
                                 "spacings differ from cell to cell there; dx, lap and the like know them");
    return {};
  }
  if (axis >= 0) {
    if (!has_axis(here, axis, range)) return {};
    return {TypedExpr::Type::number, {param(name, {range})}, {here.elaboration.measures.coordinate(axis)}};
  }
  const Symbol* meaning = here.elaboration.names.scope.find(name);
  if (meaning && !meaning->declared.is_known()) {  // a coordinate, t or pi
    const FunctionScope* inside = here.function;
    here.function = nullptr;
    TypedExpr value = named(here, ast::Name{name}, range);
    here.function = inside;
    return value;
  }
  here.elaboration.sink.report("unknown-name", range, {name}, [&] {
    std::vector<std::string> known;
    for (const ast::Identifier& parameter : here.function->function.parameters) known.push_back(parameter.name);
    return did_you_mean(name, known);
  });
  return {};
}

TypedExpr offsets(FormulaScope& here, const ast::Offsets& e, SourceRange range) {
  const bool in_operator = here.function && here.function->function.order;
  const auto argument =
      in_operator ? here.function->arguments.find(e.name) : std::map<std::string, TypedExpr>::const_iterator{};
  if (!in_operator) {
    here.elaboration.sink.report("not-allowed-here", range, {fmt::format("the neighbour {}[...]", e.name), "a formula"},
                                 "neighbours are read in kernels and operators; formulas have dx, lap and the like");
    return {};
  }
  const bool is_parameter = argument != here.function->arguments.end();
  TypedExpr value = is_parameter ? argument->second : name_in_function(here, e.name, range);
  if (value.type == TypedExpr::Type::none) return {};
  if (!is_parameter && !here.function->arguments.contains(vector_of(e.name))) {
    here.elaboration.sink.report("not-allowed-here", range,
                                 {fmt::format("the neighbour {}[...]", e.name), "an operator"},
                                 "neighbours are those of its parameters");
    return {};
  }
  const int count = static_cast<int>(e.offsets.size());
  if (count != here.axis_count()) {
    here.elaboration.sink.report(
        "wrong-length", range, {counted(here.axis_count(), "offset"), std::to_string(count)},
        fmt::format("the scene has {} {}", here.axis_count(), here.axis_count() == 1 ? "axis" : "axes"));
    return {};
  }
  for (const int cells : e.offsets) {
    if (cells >= -max_offset && cells <= max_offset) continue;
    here.elaboration.sink.report("distance-out-of-range", range,
                                 {std::to_string(cells), std::to_string(-max_offset), std::to_string(max_offset)});
    return {};
  }
  if (value.type == TypedExpr::Type::condition) as_number(here, value, range);
  if (value.type == TypedExpr::Type::condition) return {};
  for (Expr& part : value.parts) part = shift(part, e.offsets, {range});
  return value;
}

}  // namespace formulas

}  // namespace dpde::model
