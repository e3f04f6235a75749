// SPDX-License-Identifier: Apache-2.0
// Operators of the file with a given adjoint: not expanded at calls but separate fields, to which the adjoint belongs.
// Body and formulas of the adjoint see the parameters as fields, whatever the arguments are.
#include <fmt/format.h>

#include <algorithm>

#include "model/analyse/placement.h"
#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/parts.h"
#include "support/names/derivative_names.h"

namespace dpde::model {

namespace {

bool is_plain_field(const Expr& e) { return is<Field>(e); }

bool holds_part_reduction(const Expr& e) {
  return any_part(e, [](const Expr& part) {
    const Reduce* reduce = as<Reduce>(part);
    return reduce && !reduce->is_over_all();
  });
}

bool has_mixed_axes(const Problem& problem) {
  const auto is_periodic = [](const Axis& axis) { return axis.topology == Topology::periodic; };
  const auto count = std::count_if(problem.axes.begin(), problem.axes.end(), is_periodic);
  return count != 0 && count != static_cast<std::ptrdiff_t>(problem.axes.size());
}

/// u.x, u.y for the components of a vector, u for a number.
std::vector<std::string> parts_of(const std::string& parameter, const TypedExpr& argument) {
  if (argument.type != TypedExpr::Type::vector) return {parameter};
  std::vector<std::string> parts;
  for (std::size_t axis = 0; axis < argument.parts.size(); ++axis)
    parts.push_back(fmt::format("{}.{}", parameter, "xyz"[axis]));
  return parts;
}

/// Formulas of coordinates, and interpolations: stored at the placement that the operator requires.
bool is_free(const Placements& placements, const Expr& value) {
  return !is_uniform(value) && !placements.is_series(value) && !placements.natural(value);
}

/// Possible placements of free arguments: those of the other arguments, or the centres.
std::vector<Placement> places_of_others(const Placements& placements, const Apply& application) {
  std::vector<Placement> places;
  const auto add = [&](const Placement& place) {
    if (std::find(places.begin(), places.end(), place) == places.end()) places.push_back(place);
  };
  for (std::size_t i = 0; i < application.arguments.size(); ++i) {
    if (application.places[i] && !is_free(placements, application.arguments[i])) add(*application.places[i]);
  }
  add({});
  return places;
}

/// Whether an argument has an adjoint: it contains a field or an unknown of the task.
bool is_active(const Elaboration& elaboration, const Expr& argument) {
  return any_part(argument, [&](const Expr& part) {
    const Param* param = as<Param>(part);
    return is<Field>(part) || (param && elaboration.params.unknowns.contains(param->name));
  });
}

const char* const derive_it = "leave the lines adjoint ... out: what is not given is derived";

}  // namespace

namespace formulas {

namespace {

bool can_pass(FormulaScope& here, const TypedExpr& argument, SourceRange at, const std::string& what);

/// Requires numbers and vectors on uniform axes; values of arguments beyond walls must be known.
bool can_apply(FormulaScope& here, const FunctionScope& call, const ast::Call& e, SourceRange range) {
  const std::string what = fmt::format("the operator {}, whose adjoint is given", call.function.name.name);
  for (const Axis& axis : here.elaboration.problem.axes) {
    if (!axis.stretch) continue;
    here.elaboration.sink.report("not-allowed-here", range, {what + ",", "a scene with stretched axes"}, derive_it);
    return false;
  }
  for (std::size_t i = 0; i < e.arguments.size(); ++i) {
    if (!can_pass(here, call.arguments.at(call.function.parameters[i].name), e.arguments[i].value.range(), what))
      return false;
  }
  return true;
}

bool can_pass(FormulaScope& here, const TypedExpr& argument, SourceRange at, const std::string& what) {
  const auto refuse_here = [&](const std::string& part, const std::string& where, const std::string& hint) {
    here.elaboration.sink.report("not-allowed-here", at, {part, where}, hint);
    return false;
  };
  if (argument.type == TypedExpr::Type::condition) return as_number(here, argument, at).has_value();
  if (argument.type == TypedExpr::Type::tensor) return refuse_here("a tensor", "an argument of " + what, derive_it);
  const Placements placements(here.elaboration.problem);
  for (const Expr& value : argument.parts) {
    if (const auto mistake = placements.find_mistake(value)) {
      report_misplaced(here.elaboration, *mistake, at);
      return false;
    }
    if (is_plain_field(value) || is_uniform(value)) continue;
    if (holds_part_reduction(value))
      return refuse_here("a reduction along some axes", "an argument of " + what, derive_it);
    if (has_mixed_axes(here.elaboration.problem)) {
      return refuse_here("an expression", "an argument of " + what + ", on a grid with walls along some axes only",
                         "pass fields and numbers, or leave the lines adjoint ... out: what is not given is derived");
    }
  }
  return true;
}

/// The body of the operator, or, if `seed` is given, a formula of its adjoint.
TypedExpr formula_of_parameters(FormulaScope& here, const FunctionScope& call, const ast::Expr& e,
                                const TypedExpr* seed) {
  FunctionScope scope{call.function, {}, here.function};
  for (const auto& [parameter, argument] : call.arguments) {
    TypedExpr fields{argument.type, {}, argument.unit};
    for (const std::string& part : parts_of(parameter, argument)) fields.parts.push_back(field(part));
    scope.arguments.emplace(parameter, std::move(fields));
  }
  if (seed) scope.arguments.emplace(bar_of(call.function.name.name), *seed);
  here.function = &scope;
  TypedExpr value = any(here, e);
  here.function = scope.outer;
  if (value.type == TypedExpr::Type::condition) as_number(here, value, e.range());
  if (value.type == TypedExpr::Type::condition || value.type == TypedExpr::Type::none) return {};
  if (value.type == TypedExpr::Type::tensor && here.axis_count() > 1) {
    here.elaboration.sink.report("not-allowed-here", e.range(), {"a tensor", "an operator whose adjoint is given"},
                                 derive_it);
    return {};
  }
  const bool is_simple = std::none_of(value.parts.begin(), value.parts.end(), [](const Expr& component) {
    return holds_any<Reduce, Apply, Advect, NetworkCall, Solve, BandPass>(component);
  });
  if (is_simple) return value;
  here.elaboration.sink.report("not-allowed-here", e.range(),
                               {"a reduction, advect, band_pass, a network or another operator whose adjoint is given",
                                "an operator whose adjoint is given"},
                               "pass what it gives as an argument");
  return {};
}

/// One formula for each component of a parameter; 0 may stand for a vector.
bool add_adjoint(FormulaScope& here, const FunctionScope& call, const ast::AdjointItem& item, const TypedExpr& seed,
                 Operator& function) {
  const ast::Function& source = call.function;
  const auto parameter =
      std::find_if(source.parameters.begin(), source.parameters.end(),
                   [&](const ast::Identifier& name) { return bar_of(name.name) == item.target.name; });
  const std::vector<std::string> parts = parameter == source.parameters.end()
                                             ? std::vector<std::string>{}
                                             : parts_of(parameter->name, call.arguments.at(parameter->name));
  const auto known =
      std::find_if(function.adjoints.begin(), function.adjoints.end(), [&](const Operator::Adjoint& other) {
        return !parts.empty() && other.parameter == parts.front() && other.of_field == !item.accumulate;
      });
  if (parts.empty() || known != function.adjoints.end()) {
    here.elaboration.sink.report(
        "bad-given-adjoint", item.target.range,
        {item.target.name, source.name.name, parts.empty() ? "belongs to no parameter" : "is there already"},
        fmt::format(
            "the adjoint of a parameter u is u_bar, made of {}; that of a vector is a vector, u_bar = (..., ...)",
            bar_of(source.name.name)));
    return false;
  }
  TypedExpr value = formula_of_parameters(here, call, item.value, &seed);
  if (value.type == TypedExpr::Type::none) return false;
  const bool is_vector = call.arguments.at(parameter->name).type == TypedExpr::Type::vector;
  if (is_vector && value.type == TypedExpr::Type::number && is_literal(value.parts.front(), 0))
    value.parts.resize(parts.size(), value.parts.front());
  if (is_vector && !as_vector(here, value, item.value.range())) return false;
  if (!is_vector && !as_number(here, value, item.value.range())) return false;
  for (std::size_t i = 0; i < parts.size(); ++i)
    function.adjoints.push_back({parts[i], !item.accumulate, value.parts[i], {item.value.range()}});
  return true;
}

/// Whether argument `i` is a parameter of the scene that no other argument contains: then the adjoint of the number is
/// the parameter's.
bool is_lone_param(const Apply& application, std::size_t i) {
  const auto* own = as<Param>(application.arguments[i]);
  for (std::size_t other = 0; own != nullptr && other < application.arguments.size(); ++other) {
    const bool is_there = any_part(application.arguments[other], [&](const Expr& part) {
      const auto* param = as<Param>(part);
      return param != nullptr && param->name == own->name;
    });
    if (other != i && is_there) return false;
  }
  return own != nullptr;
}

/// A line with = is for a field argument, one with += for a number that is a parameter. Without this check a line of
/// the wrong kind would be ignored and the adjoint derived.
bool can_take_adjoints(FormulaScope& here, const FunctionScope& call, const Apply& application, SourceRange range) {
  const auto is_given = [&](const std::string& parameter, bool of_field) {
    return std::ranges::any_of(application.function.adjoints, [&](const Operator::Adjoint& given) {
      return given.parameter == parameter && given.of_field == of_field;
    });
  };
  for (std::size_t i = 0; i < application.arguments.size(); ++i) {
    const std::string& parameter = application.function.parameters[i];
    const bool is_field = application.places[i].has_value();
    if (!is_given(parameter, true) && !is_given(parameter, false)) continue;
    if (!is_active(here.elaboration, application.arguments[i])) continue;
    const std::string base = vector_of(parameter).empty() ? parameter : vector_of(parameter);
    if (is_given(parameter, is_field)) {
      if (is_field || is_lone_param(application, i)) continue;
      here.elaboration.sink.report("bad-given-adjoint", range,
                                   {base, call.function.name.name, "is that of a parameter, but here it is a formula"},
                                   "pass parameters themselves, each once, and write the formula in the operator");
      return false;
    }
    here.elaboration.sink.report(
        "bad-given-adjoint", range,
        {base, call.function.name.name,
         is_field ? "is that of a number, but here it is a field" : "is that of a field, but here it is a number"},
        is_field
            ? fmt::format("write adjoint {} = ..., what goes to the field at each point", bar_of(base))
            : fmt::format("write adjoint {} += ..., what each point adds to the adjoint of the number", bar_of(base)));
    return false;
  }
  return true;
}

/// Chooses a placement for each component that fits its body and formulas.
bool lay_out(FormulaScope& here, Apply& result, SourceRange range) {
  const Placements placements(here.elaboration.problem);
  const std::size_t count = result.function.body.size();
  std::optional<Placements::Mistake> first;
  for (const Placement& place : places_of_others(placements, result)) {
    for (std::size_t i = 0; i < result.arguments.size(); ++i) {
      if (is_free(placements, result.arguments[i])) result.places[i] = place;
    }
    result.results.assign(count, Placement{});
    const Placements inside = placements.inside(result, {});
    for (std::size_t c = 0; c < count; ++c)
      result.results[c] = inside.natural(result.function.body[c]).value_or(Placement{});
    const auto mistake =
        placements.is_staggered() ? placements.find_mistake_inside(result, result.results.front()) : std::nullopt;
    if (!mistake) return true;
    if (!first) first = mistake;
  }
  report_misplaced(here.elaboration, *first, range);
  return false;
}

}  // namespace

TypedExpr application(FormulaScope& here, const FunctionScope& call, const ast::Call& e, SourceRange range) {
  const ast::Function& function = call.function;
  if (!can_apply(here, call, e, range)) return {};
  const Placements placements(here.elaboration.problem);
  Apply result;
  result.function.name = function.name.name;
  for (const ast::Identifier& parameter : function.parameters) {
    const TypedExpr& argument = call.arguments.at(parameter.name);
    for (const std::string& part : parts_of(parameter.name, argument)) result.function.parameters.push_back(part);
    for (const Expr& value : argument.parts) {
      result.arguments.push_back(value);
      const bool is_everywhere = is_uniform(value) || placements.is_series(value);
      result.places.push_back(is_everywhere ? std::nullopt
                                            : std::optional(placements.natural(value).value_or(Placement{})));
    }
  }
  const TypedExpr body = formula_of_parameters(here, call, function.body, nullptr);
  if (body.type == TypedExpr::Type::none) return {};
  result.function.body = body.parts;
  TypedExpr seed{body.type, {}};
  for (std::size_t c = 0; c < body.parts.size(); ++c) seed.parts.push_back(field(seed_of(result.function, c)));
  for (const ast::AdjointItem& item : function.adjoints) {
    if (!add_adjoint(here, call, item, seed, result.function)) return {};
  }
  if (!can_take_adjoints(here, call, result, range) || !lay_out(here, result, range)) return {};
  TypedExpr value{body.type, {}};
  for (std::size_t c = 0; c < body.parts.size(); ++c) {
    result.component = static_cast<int>(c);
    value.parts.push_back(apply(result, {range}));
  }
  return value;
}

}  // namespace formulas

}  // namespace dpde::model
