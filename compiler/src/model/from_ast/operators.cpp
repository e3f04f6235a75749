// SPDX-License-Identifier: Apache-2.0
// Operators of the file whose adjoint is given: not put in where they are called, but fields of their own, so that the adjoint
// has something to stand for. Body and formulas know the parameters as fields, whatever the arguments are.
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/expressions.h"
#include "model/placement.h"
#include "support/derivative_names.h"

namespace dpde::model {

namespace {

bool is_plain_field(const Expr& e) { return std::holds_alternative<Field>(e->kind); }

bool holds_part_reduction(const Expr& e) {
  return any_part(e, [](const Expr& part) {
    const Reduce* reduce = std::get_if<Reduce>(&part->kind);
    return reduce && !reduce->is_over_all();
  });
}

bool has_mixed_axes(const Problem& problem) {
  const auto is_periodic = [](const Axis& axis) { return axis.topology == Topology::periodic; };
  const auto count = std::count_if(problem.axes.begin(), problem.axes.end(), is_periodic);
  return count != 0 && count != static_cast<std::ptrdiff_t>(problem.axes.size());
}

const char* const derive_it = "leave the lines adjoint ... out: what is not given is derived";

}  // namespace

/// Numbers only, at cell centres of uniform axes; what an argument is beyond walls must be known.
bool Expressions::can_apply(const FunctionScope& call, const ast::Call& e, SourceRange range) {
  const std::string what = fmt::format("the operator {}, whose adjoint is given,", call.function.name.name);
  const auto refuse_here = [&](SourceRange at, const std::string& what_else, const std::string& where, const std::string& hint) {
    draft_.sink.report("not-allowed-here", at, {what_else, where}, hint);
    return false;
  };
  if (Placements(draft_.problem).is_staggered()) return refuse_here(range, what, "a scene with staggered fields", derive_it);
  for (const Axis& axis : draft_.problem.axes) {
    if (axis.stretch) return refuse_here(range, what, "a scene with stretched axes", derive_it);
  }
  for (std::size_t i = 0; i < e.arguments.size(); ++i) {
    const Typed& argument = call.arguments.at(call.function.parameters[i].name);
    const SourceRange at = e.arguments[i].value.range();
    if (argument.type == Typed::Type::vector) return refuse_here(at, "a vector", "an argument of " + what.substr(0, what.size() - 1), "pass its components");
    if (!as_number(argument, at)) return false;
    const Expr& value = argument.parts.front();
    if (is_plain_field(value) || is_uniform(value)) continue;
    if (holds_part_reduction(value)) return refuse_here(at, "a reduction along some axes", "an argument of " + what.substr(0, what.size() - 1), derive_it);
    if (has_mixed_axes(draft_.problem)) {
      return refuse_here(at, "an expression", "an argument of " + what + " on a grid with walls along some axes only",
                         "pass fields and numbers, or leave the lines adjoint ... out: what is not given is derived");
    }
  }
  return true;
}

/// The body of the operator, or a formula of its adjoint.
std::optional<Expr> Expressions::formula_of_parameters(const ast::Function& function, const ast::Expr& e, bool with_seed) {
  FunctionScope scope{function, {}, function_};
  const auto add = [&](const std::string& name) { scope.arguments.emplace(name, Typed{Typed::Type::number, {field(name)}}); };
  for (const ast::Identifier& parameter : function.parameters) add(parameter.name);
  if (with_seed) add(bar_of(function.name.name));
  function_ = &scope;
  const Typed value = any(e);
  function_ = scope.outer;
  const auto number = as_number(value, e.range());
  if (!number) return std::nullopt;
  const bool is_simple = !any_part(*number, [](const Expr& part) {
    return std::holds_alternative<Reduce>(part->kind) || std::holds_alternative<Apply>(part->kind) || std::holds_alternative<Advect>(part->kind) ||
           std::holds_alternative<Infer>(part->kind);
  });
  if (is_simple) return number;
  draft_.sink.report("not-allowed-here", e.range(), {"a reduction, advect, a network or another operator whose adjoint is given", "an operator whose adjoint is given"},
                     "pass what it gives as an argument");
  return std::nullopt;
}

Typed Expressions::application(const FunctionScope& call, const ast::Call& e, SourceRange range) {
  const ast::Function& function = call.function;
  if (!can_apply(call, e, range)) return {};
  Apply result;
  result.function.name = function.name.name;
  for (const ast::Identifier& parameter : function.parameters) {
    result.function.parameters.push_back(parameter.name);
    result.arguments.push_back(call.arguments.at(parameter.name).parts.front());
  }
  const auto body = formula_of_parameters(function, function.body, false);
  if (!body) return {};
  result.function.body = *body;
  for (const ast::AdjointItem& item : function.adjoints) {
    const auto parameter = std::find_if(function.parameters.begin(), function.parameters.end(),
                                        [&](const ast::Identifier& name) { return bar_of(name.name) == item.target.name; });
    const auto known = std::find_if(result.function.adjoints.begin(), result.function.adjoints.end(), [&](const Operator::Adjoint& other) {
      return bar_of(other.parameter) == item.target.name && other.of_field == !item.accumulate;
    });
    if (parameter == function.parameters.end() || known != result.function.adjoints.end()) {
      draft_.sink.report("bad-given-adjoint", item.target.range,
                         {item.target.name, function.name.name, known != result.function.adjoints.end() ? "is there already" : "belongs to no parameter"},
                         fmt::format("the adjoint of a parameter u is u_bar, made of {}", bar_of(function.name.name)));
      return {};
    }
    const auto value = formula_of_parameters(function, item.value, true);
    if (!value) return {};
    result.function.adjoints.push_back({parameter->name, !item.accumulate, *value, {item.value.range()}});
  }
  return {Typed::Type::number, {apply(std::move(result), {range})}};
}

}  // namespace dpde::model
