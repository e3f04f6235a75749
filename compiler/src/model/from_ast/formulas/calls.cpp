// SPDX-License-Identifier: Apache-2.0
// Calls in formulas, and functions without a file of their own.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <utility>

#include "model/build.h"
#include "model/from_ast/formulas/built_ins.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/names/constants.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace formulas {

namespace {

/// The name used here for a name from other tools; "" if unknown.
std::string_view called_elsewhere(std::string_view function) {
  constexpr std::pair<std::string_view, std::string_view> names[] = {
      {"laplace", "lap(u)"},    {"laplacian", "lap(u)"}, {"Laplacian", "lap(u)"},
      {"delta", "lap(u)"},      {"nabla", "grad(u)"},    {"gradient", "grad(u)"},
      {"divergence", "div(v)"}, {"rot", "curl(v)"},      {"ddx", "dx(u)"},
      {"ddy", "dy(u)"},         {"diff", "d(u, x, 1)"},  {"Dx", "dx(u)"},
      {"ddt", "dt(u) = ..."},   {"ln", "log(u)"},        {"fabs", "abs(u)"},
      {"pow", "u^p"},           {"square", "u^2"},       {"where", "if(u > 0, a, b)"},
      {"avg", "mean(u)"},       {"int", "integral(u)"},  {"integrate", "integral(u)"},
      {"dxx", "d(u, x, 2)"},    {"dyy", "d(u, y, 2)"},   {"convect", "advect(v, u)"}};
  const auto* found = std::ranges::find(names, function, &std::pair<std::string_view, std::string_view>::first);
  return found == std::end(names) ? "" : found->second;
}

TypedExpr unknown_call(FormulaScope& here, const ast::Call& e) {
  if (const Symbol* meaning = here.elaboration.names.scope.find(e.callee)) {
    here.elaboration.sink.report("not-a-function", e.callee_range, {e.callee, std::string(word_for(meaning->role))},
                                 fmt::format("write {}*(...) to multiply", e.callee));
    return {};
  }
  here.elaboration.sink.report("unknown-function", e.callee_range, {e.callee}, [&] {
    const std::string_view known_as = called_elsewhere(e.callee);
    if (!known_as.empty()) return fmt::format("write {}", known_as);
    std::vector<std::string> known = function_names();
    for (const std::string& name : names_of<ast::Function>(here.elaboration.file)) known.push_back(name);
    for (const std::string& name : names_of<ast::Network>(here.elaboration.file)) known.push_back(name);
    return did_you_mean(e.callee, known);
  });
  return {};
}

/// A shell number of at least `least`; nullopt after a diagnostic.
std::optional<int> shell_of(FormulaScope& here, const ast::Expr& e, int least) {
  constexpr int most = 1 << 20;
  const TypedExpr typed = numeric(here, e);
  if (typed.type == TypedExpr::Type::none) return std::nullopt;
  const bool is_number = typed.parts.size() == 1 && !any_part(typed.parts.front(), [](const Expr& part) {
                           return !is<Number, Neg, Binary, Call>(part);
                         });
  const double value = is_number ? value_of(typed.parts.front(), {}).number : -1;
  if (value >= least && value <= most && std::floor(value) == value) return static_cast<int>(value);
  here.elaboration.sink.report(
      "not-whole", e.range(), {is_number ? fmt::format("{}", value) : "a formula"},
      fmt::format("shells are numbered from {} to {}: write band_pass(u, 4, 8); one wave along the longest "
                  "axis is shell 1",
                  least, most));
  return std::nullopt;
}

std::optional<int> order_of(FormulaScope& here, const ast::Expr& e) {
  const auto* number = std::get_if<ast::Number>(&e->kind);
  for (int order = 1; order <= 4; ++order) {
    if (number && number->value == order) return order;
  }
  here.elaboration.sink.report("wrong-order", e.range(), {number ? number->spelling : "this"},
                               "nest derivatives, as in lap(lap(lap(u))), for higher orders");
  return std::nullopt;
}

}  // namespace

TypedExpr call(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (const auto* function = find_declaration<ast::Function>(here.elaboration.file, e.callee))
    return user_call(here, *function, e, range);
  if (const DeclaredNetwork* network = find_network(here.elaboration, e.callee))
    return inference(here, *network, e, nullptr, range);
  const BuiltIn* known = find_built_in(e.callee);
  if (known == nullptr) return unknown_call(here, e);
  const bool has_points = here.is_of_step() || here.context == FormulaContext::quantity;
  if (known->needs == BuiltIn::Needs::points && !has_points) return refuse(here, e.callee, e.callee_range);
  if (known->needs == BuiltIn::Needs::points_of_derivative && !has_points)
    return refuse(here, "the derivative " + e.callee, e.callee_range);
  TypedExpr value = known->elaborate(here, e, range);
  if (value.type != TypedExpr::Type::none && !e.arguments.empty() && here.elaboration.measures.are_told())
    value.unit = known->unit(here.elaboration.measures, e, range);
  return value;
}

bool takes(FormulaScope& here, const ast::Call& e, int count) {
  const auto named = std::find_if(e.arguments.begin(), e.arguments.end(),
                                  [](const ast::Argument& argument) { return !argument.name.empty(); });
  const int given = static_cast<int>(e.arguments.size());
  if (named != e.arguments.end()) {
    here.elaboration.sink.report("wrong-argument-count", named->value.range(),
                                 {e.callee, counted(count, "argument"), "an argument called " + named->name},
                                 "leave the name out");
    return false;
  }
  if (given == count) return true;
  here.elaboration.sink.report("wrong-argument-count", e.callee_range,
                               {e.callee, counted(count, "argument"), std::to_string(given)});
  return false;
}

/// dt(u) of a field with equation dt(dt(u)) = ...: its velocity.
TypedExpr rate(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const bool one = e.arguments.size() == 1 && e.arguments[0].name.empty();
  const auto* field = one ? std::get_if<ast::Name>(&e.arguments[0].value->kind) : nullptr;
  const bool moves =
      field && here.elaboration.problem.velocity_of(components_of(here.elaboration, field->name).front());
  if (moves) return named(here, {velocity_name(field->name)}, range);
  here.elaboration.sink.report(
      "not-allowed-here", e.callee_range, {"dt", "a formula"},
      "dt(u) is known where the model has dt(dt(u)) = ...; elsewhere put the right-hand side of dt(u) here");
  return {};
}

/// load("path") inside a formula is an error.
TypedExpr load(FormulaScope& here, const ast::Call& e, SourceRange) {
  here.elaboration.sink.report(
      "not-allowed-here", e.callee_range, {"load", "a formula"},
      "load(\"name.npy\") stands alone after the = of data, an initial state or a coefficient");
  return {};
}

TypedExpr elementary(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const Fn fn = *find_fn(e.callee);
  if (!takes(here, e, arity(fn))) return {};
  std::vector<Expr> arguments;
  bool complete = true;
  for (const ast::Argument& argument : e.arguments) {
    const auto value = as_number(here, any(here, argument.value), argument.value.range());
    if (value) arguments.push_back(*value);
    complete = complete && value;
  }
  return complete ? number_of(model::call(fn, std::move(arguments), {range})) : TypedExpr{};
}

/// With |y| <= |x| atan(y/x), a half turn on if x < 0; elsewhere +-pi/2 - atan(x/y). So quotients are at most 1 in
/// size, and slopes do not overflow. A divisor that is not used is 1, so that derivatives stay finite.
TypedExpr angle(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 2)) return {};
  const auto y = as_number(here, any(here, e.arguments[0].value), e.arguments[0].value.range());
  const auto x = as_number(here, any(here, e.arguments[1].value), e.arguments[1].value.range());
  if (!y || !x) return {};
  constexpr double pi = std::numbers::pi;
  const Origin origin{range};
  const auto size = [&](const Expr& value) { return model::call(Fn::abs, {value}, origin); };
  const auto is_below = [&](const Expr& value) { return binary(BinaryOp::less, value, 0.0, origin); };
  const auto slope = [&](const Expr& top, const Expr& bottom) {
    return model::call(Fn::atan, {over(top, bottom, origin)}, origin);
  };
  const Expr is_flat = binary(BinaryOp::less_equal, size(*y), size(*x), origin);
  const Expr divides = binary(BinaryOp::not_equal, *x, 0.0, origin);
  const Expr flat_divisor = select(is_flat, select(divides, *x, 1.0, origin), 1.0, origin);
  const Expr steep_divisor = select(is_flat, 1.0, *y, origin);
  const Expr half_turn = select(is_below(*x), select(is_below(*y), -pi, pi, origin), 0.0, origin);
  const Expr quarter_turn = select(is_below(*y), -pi / 2, pi / 2, origin);
  return number_of(select(is_flat, plus(slope(*y, flat_divisor), half_turn, origin),
                          minus(quarter_turn, slope(*x, steep_divisor), origin), origin));
}

TypedExpr choice(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 3)) return {};
  const auto test = condition(here, e.arguments[0].value);
  const TypedExpr yes = numeric(here, e.arguments[1].value), no = numeric(here, e.arguments[2].value);
  if (!test || yes.type == TypedExpr::Type::none || no.type == TypedExpr::Type::none) return {};
  if (yes.parts.size() != no.parts.size()) {
    here.elaboration.sink.report(
        "wrong-length", e.arguments[2].value.range(),
        {counted(static_cast<int>(yes.parts.size()), "component"), std::to_string(no.parts.size())},
        "both results of an if are of the same length");
    return {};
  }
  TypedExpr result = yes;
  for (std::size_t i = 0; i < yes.parts.size(); ++i) {
    result.parts[i] = model::select(*test, yes.parts[i], no.parts[i], {range});
  }
  return result;
}

TypedExpr along_axis(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const int axis = axis_of(e.callee.substr(1));
  if (!takes(here, e, 1) || !has_axis(here, axis, e.callee_range)) return {};
  const TypedExpr operand = numeric(here, e.arguments[0].value);
  if (operand.type == TypedExpr::Type::none) return {};
  return map_parts(operand, [&](const Expr& part) { return derivative(part, axis, 1, {range}); });
}

TypedExpr along_named_axis(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const bool has_order = e.arguments.size() == 3;
  if (e.arguments.size() < 2 || e.arguments.size() > 3) {
    here.elaboration.sink.report("wrong-argument-count", e.callee_range,
                                 {e.callee, "2 or 3 arguments", std::to_string(e.arguments.size())},
                                 "write d(u, x) or d(u, x, 2)");
    return {};
  }
  if (!takes(here, e, has_order ? 3 : 2)) return {};
  const TypedExpr operand = numeric(here, e.arguments[0].value);
  const ast::Expr& place = e.arguments[1].value;
  const auto* name = std::get_if<ast::Name>(&place->kind);
  const int axis = name ? axis_of(here.elaboration, name->name) : -1;
  if (axis < 0) {
    here.elaboration.sink.report("unknown-axis", place.range(), {name ? name->name : "this"}, "write d(u, x, 2)");
    return {};
  }
  const std::optional<int> order = has_order ? order_of(here, e.arguments[2].value) : 1;
  if (!has_axis(here, axis, place.range()) || !order || operand.type == TypedExpr::Type::none) return {};
  return map_parts(operand, [&](const Expr& part) { return derivative(part, axis, *order, {range}); });
}

TypedExpr norm_call(FormulaScope& here, const ast::Call& e, SourceRange range) {
  return takes(here, e, 1) ? norm(numeric(here, e.arguments[0].value), range) : TypedExpr{};
}

TypedExpr interpolation(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 1)) return {};
  const TypedExpr operand = numeric(here, e.arguments[0].value);
  if (operand.type == TypedExpr::Type::none) return {};
  if (std::ranges::any_of(operand.parts, [&](const Expr& part) { return is_on_pole(here.elaboration.problem, part); }))
    here.elaboration.sink.report(
        "beside-pole", range, {"a value interpolated from faces on the pole"},
        "there it is 0, whatever flows over the pole: leave `on faces` out, or the rows next to poles");
  return map_parts(operand, [&](const Expr& part) { return interpolate(part, {range}); });
}

/// Shells are numbered as in `spectrum`.
TypedExpr band(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (here.context != FormulaContext::quantity) {
    here.elaboration.sink.report("not-allowed-here", e.callee_range, {"band_pass", "what a step computes"},
                                 "it stands in losses, tests, observables and what data sets keep");
    return {};
  }
  const bool has_last = e.arguments.size() == 3;
  if (e.arguments.size() != 3 && !takes(here, e, 2)) return {};
  const TypedExpr operand = numeric(here, e.arguments[0].value);
  const std::optional<int> first = shell_of(here, e.arguments[1].value, 0);
  const std::optional<int> last = has_last && first ? shell_of(here, e.arguments[2].value, *first) : first;
  if (!first || !last || operand.type == TypedExpr::Type::none) return {};
  const Problem& problem = here.elaboration.problem;
  std::string obstacle = obstacle_to_waves(problem.axes);
  if (problem.metric) obstacle = "its coordinates are no lengths";
  if (!problem.has_grid) obstacle = "the scene has no grid";
  if (!obstacle.empty()) {
    here.elaboration.sink.report("waves-do-not-fit", range, {"band_pass", obstacle},
                                 "shells of waves need periodic axes of equal cells: take means of derivatives");
    return {};
  }
  const double unit = wave_unit(problem.axes);
  double squares = 0;  // of the shortest wave, in units
  for (const Axis& axis : problem.axes) squares += std::pow(axis.cells / 2 * wave_unit({axis}) / unit, 2);
  const int shells = static_cast<int>(std::floor(std::sqrt(squares) + 0.5));
  if (*first > shells) {
    here.elaboration.sink.report("waves-do-not-fit", range,
                                 {"band_pass", fmt::format("its grid has shells 0 to {}", shells)},
                                 "half the cells along an axis are its shortest wave");
    return {};
  }
  return map_parts(operand, [&](const Expr& part) { return band_pass({part, *first, *last, unit}, {range}); });
}

}  // namespace formulas

}  // namespace dpde::model
