// SPDX-License-Identifier: Apache-2.0
// Functions and operators of the file: put in where they are called. A body knows its parameters, coordinates, t and
// pi, and that of an operator the spacings and neighbours of its parameters.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "model/build.h"
#include "model/from_ast/formulas/expressions.h"

namespace dpde::model {

namespace {

constexpr int max_expansions = 20000;
constexpr int max_offset = 64;

/// "f -> g -> f", or "" when `function` is not being put in already.
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

TypedExpr Expressions::user_call(const ast::Function& function, const ast::Call& e, SourceRange range) {
  const bool is_equation = is_of_step() || purpose_ == FormulaContext::quantity;
  if (function.order && !is_equation) return refuse("the operator " + e.callee, e.callee_range);
  const std::string cycle = cycle_to(function, function_);
  if (!cycle.empty()) {
    elaboration_.sink.report("recursive-function", e.callee_range, {e.callee, cycle},
                             "functions are put in where they are called");
    return {};
  }
  if (!takes(e, static_cast<int>(function.parameters.size()))) return {};
  if (elaboration_.expansions > max_expansions) return {};
  if (++elaboration_.expansions > max_expansions) {
    elaboration_.sink.report("too-large", range, {}, "call fewer functions inside one another");
    return {};
  }
  FunctionScope scope{function, {}, function_};
  for (std::size_t i = 0; i < function.parameters.size(); ++i) {
    TypedExpr argument = any(e.arguments[i].value);
    if (argument.type == TypedExpr::Type::none) return {};
    scope.arguments.emplace(function.parameters[i].name, std::move(argument));
  }
  const std::map<std::string, TypedExpr> running = std::exchange(running_, {});  // a body does not know them
  TypedExpr value = body(scope, e, range);
  running_ = running;
  return value;
}

TypedExpr Expressions::body(FunctionScope& scope, const ast::Call& e, SourceRange range) {
  const ast::Function& function = scope.function;
  if (!function.adjoints.empty() && !is_measuring_) {
    const TypedExpr value = application(scope, e, range);
    if (value.type != TypedExpr::Type::none) note_order(scope, value);
    return value;
  }
  function_ = &scope;
  TypedExpr value = any(function.body);
  function_ = scope.outer;
  if (is_too_large(value, range)) return {};
  if (function.order && value.type != TypedExpr::Type::none) note_order(scope, value);
  return value;
}

/// The operator by itself, of fields of its own, so that its order can be found out. What it holds was checked before.
/// Where a network is in it, it stays as it is used: networks are not measured.
void Expressions::note_order(const FunctionScope& call, const TypedExpr& value) {
  if (is_measuring_) return;
  const ast::Function& function = call.function;
  const bool holds_network = std::any_of(value.parts.begin(), value.parts.end(), [](const Expr& part) {
    return any_part(part, [](const Expr& e) {
      return std::holds_alternative<NetworkCall>(e->kind) || std::holds_alternative<Solve>(e->kind);
    });
  });
  FunctionScope scope{function, {}, function_};
  for (const auto& [name, value] : call.arguments) {
    TypedExpr argument = value;
    for (std::size_t i = 0; i < argument.parts.size(); ++i) {
      if (is_uniform(argument.parts[i])) continue;
      const Expr own = field(fmt::format("argument {} {}", name, i));
      argument.parts[i] = argument.type == TypedExpr::Type::condition ? binary(BinaryOp::greater, own, 0.0) : own;
    }
    scope.arguments.emplace(name, std::move(argument));
  }
  const std::size_t dropped = elaboration_.problem.dropped.size();
  is_measuring_ = true;
  function_ = &scope;
  const TypedExpr body = holds_network ? value : any(function.body);
  function_ = scope.outer;
  is_measuring_ = false;
  elaboration_.problem.dropped.resize(dropped);
  const StatedOrder stated{function.name.name, *function.order, body.parts, is_of_step(), {function.name.range}};
  const bool is_known = std::any_of(
      elaboration_.problem.operators.begin(), elaboration_.problem.operators.end(), [&](const StatedOrder& other) {
        return other.name == stated.name && other.body == stated.body && other.in_equations == stated.in_equations;
      });
  if (!is_known) elaboration_.problem.operators.push_back(stated);
}

TypedExpr Expressions::name_in_function(const std::string& name, SourceRange range) {
  const auto argument = function_->arguments.find(name);
  if (argument != function_->arguments.end()) return argument->second;
  if (name == "identity") return identity();
  const std::string base = vector_of(name);
  const auto vector = function_->arguments.find(base);
  if (vector != function_->arguments.end() && vector->second.type == TypedExpr::Type::vector) {
    const int axis = axis_of(name.substr(base.size() + 1));
    if (axis < 0 || !has_axis(axis, range)) return {};
    return {TypedExpr::Type::number, {vector->second.parts[axis]}};
  }
  if (vector != function_->arguments.end() && vector->second.type == TypedExpr::Type::tensor) {
    const auto part = tensor_component(vector->second, {name.substr(base.size() + 1), range});
    return part ? number_of(*part) : TypedExpr{};
  }
  const int axis = function_->function.order ? spacing_of(name) : -1;
  if (axis >= 0 && axis < axis_count() && elaboration_.problem.axes[static_cast<std::size_t>(axis)].stretch) {
    elaboration_.sink.report("on-stretched-axis", range, {"the spacing " + name, axis_name(axis)},
                             "spacings differ from cell to cell there; dx, lap and the like know them");
    return {};
  }
  if (axis >= 0)
    return has_axis(axis, range) ? TypedExpr{TypedExpr::Type::number, {param(name, {range})}} : TypedExpr{};
  const Symbol* meaning = elaboration_.scope.find(name);
  if (meaning && !meaning->declared.is_known()) {  // a coordinate, t or pi
    const FunctionScope* inside = function_;
    function_ = nullptr;
    TypedExpr value = this->name(ast::Name{name}, range);
    function_ = inside;
    return value;
  }
  elaboration_.sink.report("unknown-name", range, {name}, [&] {
    std::vector<std::string> known;
    for (const ast::Identifier& parameter : function_->function.parameters) known.push_back(parameter.name);
    return did_you_mean(name, known);
  });
  return {};
}

TypedExpr Expressions::offsets(const ast::Offsets& e, SourceRange range) {
  const bool in_operator = function_ && function_->function.order;
  const auto argument =
      in_operator ? function_->arguments.find(e.name) : std::map<std::string, TypedExpr>::const_iterator{};
  if (!in_operator) {
    elaboration_.sink.report("not-allowed-here", range, {fmt::format("the neighbour {}[...]", e.name), "a formula"},
                             "neighbours are read in kernels and operators; formulas have dx, lap and the like");
    return {};
  }
  const bool is_parameter = argument != function_->arguments.end();
  TypedExpr value = is_parameter ? argument->second : name_in_function(e.name, range);
  if (value.type == TypedExpr::Type::none) return {};
  if (!is_parameter && !function_->arguments.contains(vector_of(e.name))) {
    elaboration_.sink.report("not-allowed-here", range, {fmt::format("the neighbour {}[...]", e.name), "an operator"},
                             "neighbours are those of its parameters");
    return {};
  }
  const int count = static_cast<int>(e.offsets.size());
  if (count != axis_count()) {
    elaboration_.sink.report("wrong-length", range, {counted(axis_count(), "offset"), std::to_string(count)},
                             fmt::format("the scene has {} {}", axis_count(), axis_count() == 1 ? "axis" : "axes"));
    return {};
  }
  for (const int cells : e.offsets) {
    if (cells >= -max_offset && cells <= max_offset) continue;
    elaboration_.sink.report("distance-out-of-range", range,
                             {std::to_string(cells), std::to_string(-max_offset), std::to_string(max_offset)});
    return {};
  }
  if (value.type == TypedExpr::Type::condition) as_number(value, range);
  if (value.type == TypedExpr::Type::condition) return {};
  for (Expr& part : value.parts) part = shift(part, e.offsets, {range});
  return value;
}

}  // namespace dpde::model
