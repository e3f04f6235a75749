// SPDX-License-Identifier: Apache-2.0
// Functions and operators: which there are, what they take, and what they are over the axes of the scene.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "model/build.h"
#include "model/from_ast/formulas/expressions.h"
#include "model/from_ast/names/constants.h"
#include "model/from_ast/parts.h"
#include "support/assert.h"

namespace dpde::model {

namespace {

constexpr const char* operator_names[] = {
    "dx",        "dy",       "dz",        "d",        "lap",         "grad",         "div",
    "advect",    "bracket",  "dot",       "curl",     "norm",        "if",           "mean",
    "sum",       "integral", "inject",    "sample",   "interpolate", "random_field", "random_signal",
    "noise",     "force_on", "torque_on", "cross",    "outer",       "inner",        "sym",
    "transpose", "trace",    "average",   "band_pass"};

}  // namespace

std::vector<std::string> Expressions::function_names() {
  std::vector<std::string> names(std::begin(operator_names), std::end(operator_names));
  for (int i = 0; i <= static_cast<int>(Fn::max); ++i) names.emplace_back(name_of(static_cast<Fn>(i)));
  return names;
}

bool Expressions::is_built_in(const std::string& function) {
  const std::vector<std::string> names = function_names();
  return function == "dt" || function == "load" || std::find(names.begin(), names.end(), function) != names.end();
}

TypedExpr Expressions::call(const ast::Call& e, SourceRange range) {
  const std::string& name = e.callee;
  if (const auto* function = find_declaration<ast::Function>(elaboration_.file, name))
    return user_call(*function, e, range);
  if (const DeclaredNetwork* network = find_network(elaboration_, name)) return inference(*network, e, nullptr, range);
  const bool is_derivative = name == "dx" || name == "dy" || name == "dz" || name == "d" || name == "lap" ||
                             name == "grad" || name == "div" || name == "advect" || name == "bracket" || name == "curl";
  const bool is_equation = is_of_step() || purpose_ == FormulaContext::quantity;
  if (name == "interpolate" && !is_equation) return refuse("interpolate", e.callee_range);
  if (is_derivative && !is_equation) return refuse("the derivative " + name, e.callee_range);
  if (name == "dt") return rate(e, range);
  if (name == "dx") return along(0, e, range);
  if (name == "dy") return along(1, e, range);
  if (name == "dz") return along(2, e, range);
  if (name == "d") return along_named_axis(e, range);
  if (name == "lap") return laplacian(e, range);
  if (name == "grad") return gradient(e, range);
  if (name == "div") return divergence(e, range);
  if (name == "advect") return advection(e, range);
  if (name == "bracket") return poisson_bracket(e, range);
  if (name == "dot") return dot_product(e, range);
  if (name == "cross") return cross_product(e, range);
  if (name == "curl") return curl(e, range);
  if (const auto value = tensor_call(e, range)) return *value;
  if (name == "norm") return takes(e, 1) ? norm(numeric(e.arguments[0].value), range) : TypedExpr{};
  if (name == "interpolate") return interpolation(e, range);
  if (name == "band_pass") return band(e, range);
  if (name == "if") return choice(e, range);
  if (is_quadrature(e)) return quadrature(e, range);
  if (const auto kind = reduction_called(e)) return reduction(*kind, e, range);
  if (name == "average") return average(e, range);
  if (name == "force_on") return force(e, range);
  if (name == "torque_on") return torque(e, range);
  if (name == "sample") return sampling(e, range);
  if (name == "inject") return injection(e, range);
  if (name == "random_field" || name == "random_signal") return random_waves(e, range);
  if (name == "noise") return white_noise(e, range);
  if (const auto fn = find_fn(name)) return elementary(*fn, e, range);
  return unknown_call(e);
}

/// dt(u) of a field whose equation is dt(dt(u)) = ...: its velocity.
TypedExpr Expressions::rate(const ast::Call& e, SourceRange range) {
  const bool one = e.arguments.size() == 1 && e.arguments[0].name.empty();
  const auto* field = one ? std::get_if<ast::Name>(&e.arguments[0].value->kind) : nullptr;
  const bool moves = field && elaboration_.problem.velocity_of(components_of(elaboration_, field->name).front());
  if (moves) return name({velocity_name(field->name)}, range);
  elaboration_.sink.report(
      "not-allowed-here", e.callee_range, {"dt", "a formula"},
      "dt(u) is known where the model has dt(dt(u)) = ...; elsewhere put the right-hand side of dt(u) here");
  return {};
}

namespace {

/// What other tools call it, by what is written here; "" where nothing is known.
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

}  // namespace

TypedExpr Expressions::unknown_call(const ast::Call& e) {
  if (e.callee == "load") {
    elaboration_.sink.report("not-allowed-here", e.callee_range, {"load", "a formula"},
                             "load(\"name.npy\") stands alone behind the = of data, an initial state or a coefficient");
    return {};
  }
  if (const Symbol* meaning = elaboration_.scope.find(e.callee)) {
    elaboration_.sink.report("not-a-function", e.callee_range, {e.callee, std::string(word_for(meaning->role))},
                             fmt::format("write {}*(...) to multiply", e.callee));
    return {};
  }
  elaboration_.sink.report("unknown-function", e.callee_range, {e.callee}, [&] {
    const std::string_view here = called_elsewhere(e.callee);
    if (!here.empty()) return fmt::format("write {}", std::string(here));
    std::vector<std::string> known = function_names();
    for (const std::string& name : names_of<ast::Function>(elaboration_.file)) known.push_back(name);
    for (const std::string& name : names_of<ast::Network>(elaboration_.file)) known.push_back(name);
    return did_you_mean(e.callee, known);
  });
  return {};
}

bool Expressions::takes(const ast::Call& e, int count) {
  const auto named = std::find_if(e.arguments.begin(), e.arguments.end(),
                                  [](const ast::Argument& argument) { return !argument.name.empty(); });
  const int given = static_cast<int>(e.arguments.size());
  if (named != e.arguments.end()) {
    elaboration_.sink.report("wrong-argument-count", named->value.range(),
                             {e.callee, counted(count, "argument"), "one called " + named->name}, "leave the name out");
    return false;
  }
  if (given == count) return true;
  elaboration_.sink.report("wrong-argument-count", e.callee_range,
                           {e.callee, counted(count, "argument"), std::to_string(given)});
  return false;
}

TypedExpr Expressions::elementary(Fn fn, const ast::Call& e, SourceRange range) {
  if (!takes(e, arity(fn))) return {};
  std::vector<Expr> arguments;
  bool complete = true;
  for (const ast::Argument& argument : e.arguments) {
    const auto value = as_number(any(argument.value), argument.value.range());
    if (value) arguments.push_back(*value);
    complete = complete && value;
  }
  return complete ? number_of(model::call(fn, std::move(arguments), {range})) : TypedExpr{};
}

TypedExpr Expressions::choice(const ast::Call& e, SourceRange range) {
  if (!takes(e, 3)) return {};
  const auto test = condition(e.arguments[0].value);
  const TypedExpr yes = numeric(e.arguments[1].value), no = numeric(e.arguments[2].value);
  if (!test || yes.type == TypedExpr::Type::none || no.type == TypedExpr::Type::none) return {};
  if (yes.parts.size() != no.parts.size()) {
    elaboration_.sink.report(
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

TypedExpr Expressions::along(int axis, const ast::Call& e, SourceRange range) {
  if (!takes(e, 1) || !has_axis(axis, e.callee_range)) return {};
  const TypedExpr operand = numeric(e.arguments[0].value);
  if (operand.type == TypedExpr::Type::none) return {};
  return map_parts(operand, [&](const Expr& part) { return derivative(part, axis, 1, {range}); });
}

TypedExpr Expressions::interpolation(const ast::Call& e, SourceRange range) {
  if (!takes(e, 1)) return {};
  const TypedExpr operand = numeric(e.arguments[0].value);
  if (operand.type == TypedExpr::Type::none) return {};
  if (std::ranges::any_of(operand.parts, [&](const Expr& part) { return is_on_pole(elaboration_.problem, part); }))
    elaboration_.sink.report(
        "beside-pole", range, {"what is interpolated from faces on the pole"},
        "there it is 0, whatever flows over the pole: leave `on faces` out, or the rows beside poles");
  return map_parts(operand, [&](const Expr& part) { return interpolate(part, {range}); });
}

/// Shells as `spectrum` counts them.
TypedExpr Expressions::band(const ast::Call& e, SourceRange range) {
  if (purpose_ != FormulaContext::quantity) {
    elaboration_.sink.report("not-allowed-here", e.callee_range, {"band_pass", "what a step computes"},
                             "it stands in losses, tests, observables and what data sets keep");
    return {};
  }
  const bool has_last = e.arguments.size() == 3;
  if (e.arguments.size() != 3 && !takes(e, 2)) return {};
  const TypedExpr operand = numeric(e.arguments[0].value);
  const std::optional<int> first = shell_of(e.arguments[1].value, 0);
  const std::optional<int> last = has_last && first ? shell_of(e.arguments[2].value, *first) : first;
  if (!first || !last || operand.type == TypedExpr::Type::none) return {};
  const Problem& problem = elaboration_.problem;
  std::string obstacle = obstacle_to_waves(problem.axes);
  if (problem.metric) obstacle = "its coordinates are no lengths";
  if (!problem.has_grid) obstacle = "the scene has no grid";
  if (!obstacle.empty()) {
    elaboration_.sink.report("waves-do-not-fit", range, {"band_pass", obstacle},
                             "shells of waves need periodic axes of equal cells: take means of derivatives");
    return {};
  }
  const double unit = wave_unit(problem.axes);
  double squares = 0;  // of the shortest wave, in units
  for (const Axis& axis : problem.axes) squares += std::pow(axis.cells / 2 * wave_unit({axis}) / unit, 2);
  const int shells = static_cast<int>(std::floor(std::sqrt(squares) + 0.5));
  if (*first > shells) {
    elaboration_.sink.report("waves-do-not-fit", range,
                             {"band_pass", fmt::format("its grid has shells 0 to {}", shells)},
                             "half the cells along an axis are its shortest wave");
    return {};
  }
  return map_parts(operand, [&](const Expr& part) { return band_pass({part, *first, *last, unit}, {range}); });
}

/// A number, or what an argument of a function or an index is.
std::optional<int> Expressions::shell_of(const ast::Expr& e, int least) {
  constexpr int most = 1 << 20;
  const TypedExpr typed = numeric(e);
  if (typed.type == TypedExpr::Type::none) return std::nullopt;
  const bool is_number =
      typed.parts.size() == 1 && !any_part(typed.parts.front(), [](const Expr& part) {
        return !std::holds_alternative<Number>(part->kind) && !std::holds_alternative<Neg>(part->kind) &&
               !std::holds_alternative<Binary>(part->kind) && !std::holds_alternative<Call>(part->kind);
      });
  const double value = is_number ? value_of(typed.parts.front(), {}).number : -1;
  if (value >= least && value <= most && std::floor(value) == value) return static_cast<int>(value);
  elaboration_.sink.report(
      "not-whole", e.range(), {is_number ? fmt::format("{}", value) : "a formula"},
      fmt::format("shells are numbered from {} to {}: write band_pass(u, 4, 8); one wave along the longest "
                  "axis is shell 1",
                  least, most));
  return std::nullopt;
}

TypedExpr Expressions::along_named_axis(const ast::Call& e, SourceRange range) {
  const bool has_order = e.arguments.size() == 3;
  if (!takes(e, has_order ? 3 : 2)) return {};
  const TypedExpr operand = numeric(e.arguments[0].value);
  const ast::Expr& place = e.arguments[1].value;
  const auto* name = std::get_if<ast::Name>(&place->kind);
  const int axis = name ? axis_of(elaboration_, name->name) : -1;
  if (axis < 0) {
    elaboration_.sink.report("unknown-axis", place.range(), {name ? name->name : "this"}, "write d(u, x, 2)");
    return {};
  }
  const std::optional<int> order = has_order ? order_of(e.arguments[2].value) : 1;
  if (!has_axis(axis, place.range()) || !order || operand.type == TypedExpr::Type::none) return {};
  return map_parts(operand, [&](const Expr& part) { return derivative(part, axis, *order, {range}); });
}

std::optional<int> Expressions::order_of(const ast::Expr& e) {
  const auto* number = std::get_if<ast::Number>(&e->kind);
  for (int order = 1; order <= 4; ++order) {
    if (number && number->value == order) return order;
  }
  elaboration_.sink.report("wrong-order", e.range(), {number ? number->spelling : "this"},
                           "nest derivatives, as in lap(lap(lap(u))), for higher orders");
  return std::nullopt;
}

}  // namespace dpde::model
