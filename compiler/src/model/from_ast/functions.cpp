// SPDX-License-Identifier: Apache-2.0
// Functions and operators of the file: put in where they are called. A body knows its parameters, coordinates, t and pi,
// and that of an operator the spacings and neighbours of its parameters.
#include <fmt/format.h>

#include "model/build.h"
#include "model/from_ast/expressions.h"

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

Typed Expressions::user_call(const ast::Function& function, const ast::Call& e, SourceRange range) {
  const bool is_equation = purpose_ == Purpose::equation || purpose_ == Purpose::quantity;
  if (function.order && !is_equation) return refuse("the operator " + e.callee, e.callee_range);
  const std::string cycle = cycle_to(function, function_);
  if (!cycle.empty()) {
    draft_.sink.report("recursive-function", e.callee_range, {e.callee, cycle}, "functions are put in where they are called");
    return {};
  }
  if (!takes(e, static_cast<int>(function.parameters.size()))) return {};
  if (draft_.expansions > max_expansions) return {};
  if (++draft_.expansions > max_expansions) {
    draft_.sink.report("too-large", range, {}, "call fewer functions inside one another");
    return {};
  }
  FunctionScope scope{function, {}, function_};
  for (std::size_t i = 0; i < function.parameters.size(); ++i) {
    Typed argument = any(e.arguments[i].value);
    if (argument.type == Typed::Type::none) return {};
    scope.arguments.emplace(function.parameters[i].name, std::move(argument));
  }
  if (!function.adjoints.empty()) return application(scope, e, range);
  function_ = &scope;
  Typed value = any(function.body);
  function_ = scope.outer;
  return is_too_large(value, range) ? Typed{} : value;
}

Typed Expressions::name_in_function(const std::string& name, SourceRange range) {
  const auto argument = function_->arguments.find(name);
  if (argument != function_->arguments.end()) return argument->second;
  const std::string base = vector_of(name);
  const auto vector = function_->arguments.find(base);
  if (vector != function_->arguments.end() && vector->second.type == Typed::Type::vector) {
    const int axis = axis_of(name.substr(base.size() + 1));
    if (axis < 0 || !has_axis(axis, range)) return {};
    return {Typed::Type::number, {vector->second.parts[axis]}};
  }
  const int axis = function_->function.order ? spacing_of(name) : -1;
  if (axis >= 0 && axis < axis_count() && draft_.problem.axes[static_cast<std::size_t>(axis)].stretch) {
    draft_.sink.report("on-stretched-axis", range, {"the spacing " + name, axis_name(axis)},
                       "spacings differ from cell to cell there; dx, lap and the like know them");
    return {};
  }
  if (axis >= 0) return has_axis(axis, range) ? Typed{Typed::Type::number, {param(name, {range})}} : Typed{};
  const Meaning* meaning = draft_.scope.find(name);
  if (meaning && !meaning->declared.is_known()) {  // a coordinate, t or pi
    const FunctionScope* inside = function_;
    function_ = nullptr;
    Typed value = this->name(ast::Name{name}, range);
    function_ = inside;
    return value;
  }
  std::vector<std::string> known;
  for (const ast::Identifier& parameter : function_->function.parameters) known.push_back(parameter.name);
  draft_.sink.report("unknown-name", range, {name}, did_you_mean(name, known));
  return {};
}

Typed Expressions::offsets(const ast::Offsets& e, SourceRange range) {
  const bool in_operator = function_ && function_->function.order;
  const auto argument = in_operator ? function_->arguments.find(e.name) : std::map<std::string, Typed>::const_iterator{};
  if (!in_operator) {
    draft_.sink.report("not-allowed-here", range, {fmt::format("the neighbour {}[...]", e.name), "a formula"},
                       "neighbours are read in kernels and operators; formulas have dx, lap and the like");
    return {};
  }
  if (argument == function_->arguments.end()) {
    name_in_function(e.name, range);
    return {};
  }
  const int count = static_cast<int>(e.offsets.size());
  if (count != axis_count()) {
    draft_.sink.report("wrong-length", range, {counted(axis_count(), "offset"), std::to_string(count)},
                       fmt::format("the scene has {} {}", axis_count(), axis_count() == 1 ? "axis" : "axes"));
    return {};
  }
  for (const int cells : e.offsets) {
    if (cells >= -max_offset && cells <= max_offset) continue;
    draft_.sink.report("distance-out-of-range", range,
                       {std::to_string(cells), std::to_string(-max_offset), std::to_string(max_offset)});
    return {};
  }
  Typed value = argument->second;
  if (value.type == Typed::Type::condition) as_number(value, range);
  if (value.type == Typed::Type::condition) return {};
  for (Expr& part : value.parts) part = shift(part, e.offsets, {range});
  return value;
}

}  // namespace dpde::model
