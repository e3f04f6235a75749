// SPDX-License-Identifier: Apache-2.0
// Vectors: their components, and the operators over the axes of the scene.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "model/analyse/placement.h"
#include "model/boundary/metric.h"
#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/parts.h"
#include "model/from_ast/scene/coordinates.h"

namespace dpde::model {

namespace {

Expr dot(const std::vector<Expr>& a, const std::vector<Expr>& b, Origin origin) {
  Expr sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum = binary(BinaryOp::add, sum, binary(BinaryOp::multiply, a[i], b[i], origin), origin);
  }
  return sum;
}

}  // namespace

namespace formulas {

namespace {

/// Requires unit vectors that rotate from point to point by a single angle: on two axes.
bool can_take_vector_laplacian(FormulaScope& here, const TypedExpr& operand, SourceRange range) {
  const std::optional<Metric>& metric = here.elaboration.problem.metric;
  const auto is_elsewhere = [&](const Expr& part) {
    const Placements placements(here.elaboration.problem);
    return placements.natural(part) != placements.natural(operand.parts.front());
  };
  if (metric && operand.type == TypedExpr::Type::tensor)
    return !is_refused_in_curves(here.elaboration, "lap of a tensor", range);
  const bool is_one_place = std::ranges::none_of(operand.parts, is_elsewhere);
  if (!metric || (here.axis_count() == 2 && is_literal(metric->around, 1) && is_one_place)) return true;
  const std::string what = std::string("lap of a vector") + (here.axis_count() == 3 ? " on three axes"
                                                             : is_one_place         ? ""
                                                                                    : " on faces");
  here.elaboration.sink.report("in-curved-coordinates", range, {what, metric->name},
                               is_one_place
                                   ? "write grad(div(v)) - curl(curl(v)), or lap of a number"
                                   : "it needs both components at one place: leave `on faces` out of the vector");
  return false;
}

}  // namespace

TypedExpr tuple(FormulaScope& here, const ast::Tuple& e) {
  const bool has_rows = std::ranges::any_of(
      e.elements, [](const ast::Expr& element) { return std::holds_alternative<ast::Tuple>(element->kind); });
  if (has_rows) return rows(here, e);
  TypedExpr result{TypedExpr::Type::vector, {}};
  bool complete = true;
  for (const ast::Expr& element : e.elements) {
    const auto part = as_number(here, any(here, element), element.range());
    if (part) result.parts.push_back(*part);
    complete = complete && part;
  }
  return complete ? result : TypedExpr{};
}

std::optional<std::vector<Expr>> as_vector(FormulaScope& here, const TypedExpr& value, SourceRange range) {
  if (value.type == TypedExpr::Type::none) return std::nullopt;
  if (value.type == TypedExpr::Type::condition) {
    as_number(here, value, range);
    return std::nullopt;
  }
  const int count = static_cast<int>(value.parts.size());
  if (count == here.axis_count()) return value.parts;
  if (value.type == TypedExpr::Type::tensor) {
    here.elaboration.sink.report("vector-operation", range, {"an operator for vectors", "a tensor"},
                                 "div(S) and dot(S, v) make vectors of a tensor");
    return std::nullopt;
  }
  std::vector<std::string> example;
  for (int axis = 0; axis < here.axis_count(); ++axis) example.push_back(std::string("v") + axis_name(axis));
  here.elaboration.sink.report("wrong-length", range, {counted(here.axis_count(), "component"), std::to_string(count)},
                               here.axis_count() == 1
                                   ? "the scene has one axis: write a number"
                                   : fmt::format("one component an axis: ({})", fmt::join(example, ", ")));
  return std::nullopt;
}

std::optional<std::vector<Expr>> components(FormulaScope& here, const ast::Expr& e, const std::string& name) {
  const Symbol* meaning = here.elaboration.names.scope.find(state_name(name));
  if (!meaning || !meaning->is_vector) {
    const auto value = number(here, e);
    return value ? std::optional(std::vector<Expr>{*value}) : std::nullopt;
  }
  const TypedExpr value = definition(here, e);
  if (value.type == TypedExpr::Type::number && is_literal(value.parts.front(), 0)) {
    return std::vector<Expr>(here.axis_count(), value.parts.front());
  }
  return as_vector(here, value, e.range());
}

TypedExpr vector(FormulaScope& here, const std::string& name, SourceRange range) {
  TypedExpr result{TypedExpr::Type::vector, {}};
  for (const std::string& component : components_of(here.elaboration, name)) {
    here.elaboration.params.used.insert(component);
    result.parts.push_back(field(component, {range}));
  }
  return result;
}

/// u.x if it is not a field itself: a component of a let, or an error.
TypedExpr component(FormulaScope& here, const ast::Identifier& name) {
  const std::string base = vector_of(name.name);
  const Symbol* meaning = here.elaboration.names.scope.find(base);
  if (meaning && meaning->is_vector && here.axis_count() == 0) return named(here, ast::Name{base}, name.range);
  const auto found = here.elaboration.names.lets.find(base);
  const std::string part = name.name.substr(base.size() + 1);
  const int axis = axis_of(here.elaboration, part);
  if (here.elaboration.names.scene_lets.contains(base)) {
    const TypedExpr whole = scene_let(here, base, name.range);
    if (whole.type == TypedExpr::Type::tensor) return tensor_component(here, whole, {part, name.range});
    const bool fits = whole.type == TypedExpr::Type::vector && axis >= 0 && axis < here.axis_count();
    if (!fits && whole.type != TypedExpr::Type::none)
      report_unknown(here.elaboration, name, [] { return std::vector<std::string>(); });
    return fits ? part_of(whole, axis) : TypedExpr{};
  }
  if (found != here.elaboration.names.lets.end() && found->second.type == TypedExpr::Type::vector && axis >= 0 &&
      axis < here.axis_count()) {
    const TypedExpr whole = named(here, ast::Name{base}, name.range);
    return whole.type == TypedExpr::Type::none ? whole : part_of(whole, axis);
  }
  if (found != here.elaboration.names.lets.end() && found->second.type == TypedExpr::Type::tensor) {
    const TypedExpr whole = named(here, ast::Name{base}, name.range);
    return whole.type == TypedExpr::Type::none ? whole : tensor_component(here, whole, {part, name.range});
  }
  const bool failed_before = meaning && meaning->role == Role::let && found == here.elaboration.names.lets.end();
  if (!failed_before) report_unknown(here.elaboration, name, [&] { return here.elaboration.names.scope.names(); });
  return {};
}

/// grad(u).x; on one axis a number also counts as a vector.
TypedExpr component(FormulaScope& here, const ast::Component& e, SourceRange range) {
  if (const auto* call = std::get_if<ast::Call>(&e.operand->kind)) {
    const DeclaredNetwork* network = find_network(here.elaboration, call->callee);
    if (network && !network->outputs.empty()) return inference(here, *network, *call, &e.name, range);
    if (network && !network->vector) {  // on one axis too, where numbers are vectors: this one would not be one on two
      here.elaboration.sink.report("no-components", range, {"the output of network " + call->callee, "number"},
                                   fmt::format("write {0}(...) alone, or network {0}(...) -> vector", call->callee));
      return {};
    }
  }
  const TypedExpr whole = numeric(here, e.operand);
  if (whole.type == TypedExpr::Type::none) return {};
  if (whole.type == TypedExpr::Type::tensor) return tensor_component(here, whole, e.name);
  const int axis = axis_of(e.name.name);
  const bool is_vector = whole.type == TypedExpr::Type::vector || (here.axis_count() == 1 && axis == 0);
  if (!is_vector) {
    here.elaboration.sink.report("no-components", range, {"this", describe(whole)});
    return {};
  }
  if (axis >= 0) return has_axis(here, axis, e.name.range) ? part_of(whole, axis) : TypedExpr{};
  here.elaboration.sink.report("unknown-axis", e.name.range, {e.name.name}, "components are called x, y and z");
  return {};
}

TypedExpr laplacian(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 1)) return {};
  const TypedExpr operand = numeric(here, e.arguments[0].value);
  if (operand.type == TypedExpr::Type::none) return {};
  look_beside_poles(here, operand.parts, 0, range);
  const Coordinates coordinates(here.elaboration.problem, {range});
  if (operand.type == TypedExpr::Type::number) return number_of(coordinates.laplacian(operand.parts.front()));
  if (!can_take_vector_laplacian(here, operand, range)) return {};
  return {operand.type, coordinates.vector_laplacian(operand.parts)};
}

TypedExpr gradient(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 1)) return {};
  const TypedExpr value = numeric(here, e.arguments[0].value);
  if (value.type == TypedExpr::Type::vector && value.parts.size() > 1) return vector_gradient(here, value.parts, range);
  const auto operand = as_number(here, value, e.arguments[0].value.range());
  if (!operand) return {};
  look_beside_poles(here, {*operand}, 0, range);
  TypedExpr result{TypedExpr::Type::vector, {}};
  const Coordinates coordinates(here.elaboration.problem, {range});
  for (int axis = 0; axis < here.axis_count(); ++axis) result.parts.push_back(coordinates.slope(*operand, axis));
  return result;
}

TypedExpr divergence(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 1)) return {};
  const TypedExpr value = numeric(here, e.arguments[0].value);
  if (value.type == TypedExpr::Type::tensor) return tensor_divergence(here, value.parts, range);
  const auto components = as_vector(here, value, e.arguments[0].value.range());
  if (!components) return {};
  look_beside_poles(here, *components, 1, range);
  return number_of(Coordinates(here.elaboration.problem, {range}).divergence(*components));
}

TypedExpr advection(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 2)) return {};
  const auto velocity = as_vector(here, any(here, e.arguments[0].value), e.arguments[0].value.range());
  const TypedExpr operand = numeric(here, e.arguments[1].value);
  if (!velocity || operand.type == TypedExpr::Type::none) return {};
  if (operand.type == TypedExpr::Type::tensor && is_refused_in_curves(here.elaboration, "advect of a tensor", range))
    return {};
  const Placements placements(here.elaboration.problem);
  const auto is_apart = [&](const Expr& part) {
    return placements.natural(part) != placements.natural(operand.parts.front());
  };
  const bool has_poles = has_pole(here.elaboration.problem);
  if (has_poles && std::ranges::any_of(operand.parts, is_apart)) {  // 0 on the pole, whatever the flow there
    here.elaboration.sink.report(
        "in-curved-coordinates", range, {"advect of a vector on faces", "coordinates with a pole"},
        "write cross(curl(v), v) + grad(dot(v, v)/2), which is the same, or leave `on faces` out");
    return {};
  }
  if (std::ranges::any_of(*velocity, [&](const Expr& part) { return is_on_pole(here.elaboration.problem, part); })) {
    here.elaboration.sink.report("in-curved-coordinates", range,
                                 {"advect by a vector on faces", "coordinates with a pole"},
                                 "write div(v*interpolate(f)) of a number f, less f*div(v) where v is not free of it");
    return {};
  }
  return {operand.type, Coordinates(here.elaboration.problem, {range}).advection(*velocity, operand.parts)};
}

/// [a, b] = dx(a) dy(b) - dy(a) dx(b), as the mean of three forms; the other two are dx(a dy(b)) - dy(a dx(b)) and dy(b
/// dx(a)) - dx(b dy(a)). If differences satisfy summation by parts, the sums of b times the first and the third form
/// cancel, and that of b times the second is 0; likewise for a. So the sums of a [a, b], b [a, b] and [a, b] are 0.
/// With differences of order 2 this is the nine-point form of A. Arakawa, J. Comput. Phys. 1 (1966) 119, equation 46.
TypedExpr poisson_bracket(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 2)) return {};
  const auto a = as_number(here, any(here, e.arguments[0].value), e.arguments[0].value.range());
  const TypedExpr second = numeric(here, e.arguments[1].value);
  if (!a || second.type == TypedExpr::Type::none) return {};
  if (here.axis_count() == 1) {
    here.elaboration.sink.report("vector-operation", e.callee_range, {"bracket", "one axis"},
                                 "a grid line for y adds an axis");
    return {};
  }
  if (here.elaboration.problem.metric && here.axis_count() == 3) {
    here.elaboration.sink.report("in-curved-coordinates", range,
                                 {"bracket on three axes", here.elaboration.problem.metric->name}, "");
    return {};
  }
  const Origin origin{range};
  const Coordinates coordinates(here.elaboration.problem, origin);
  const auto d = [&](const Expr& f, int axis) { return derivative(f, axis, 1, origin); };
  const auto times = [&](const Expr& f, const Expr& g) { return binary(BinaryOp::multiply, f, g, origin); };
  const auto less = [&](const Expr& f, const Expr& g) { return binary(BinaryOp::subtract, f, g, origin); };
  const auto plus = [&](const Expr& f, const Expr& g) { return binary(BinaryOp::add, f, g, origin); };
  return map_parts(second, [&](const Expr& b) {
    const Expr at_point = less(times(d(*a, 0), d(b, 1)), times(d(*a, 1), d(b, 0)));
    const Expr of_a = less(d(times(*a, d(b, 1)), 0), d(times(*a, d(b, 0)), 1));
    const Expr of_b = less(d(times(b, d(*a, 0)), 1), d(times(b, d(*a, 1)), 0));
    return coordinates.per_area(binary(BinaryOp::divide, plus(plus(at_point, of_a), of_b), 3.0, origin));
  });
}

/// On two axes dx(v.y) - dy(v.x), a number, or for a number s the vector (dy(s), -dx(s)); on three axes a vector.
TypedExpr curl(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 1)) return {};
  const TypedExpr value = numeric(here, e.arguments[0].value);
  if (value.type == TypedExpr::Type::none) return {};
  look_beside_poles(here, value.parts, 0, range);
  const Coordinates coordinates(here.elaboration.problem, {range});
  if (here.axis_count() == 2 && value.type == TypedExpr::Type::number) {
    if (here.elaboration.problem.metric && !is_literal(here.elaboration.problem.metric->around, 1)) {
      here.elaboration.sink.report("in-curved-coordinates", range,
                                   {"curl of a number", here.elaboration.problem.metric->name},
                                   "of a stream function s write (dy(s)/r, -dx(s)/r)");
      return {};
    }
    const Expr& s = value.parts[0];
    return {TypedExpr::Type::vector, {coordinates.slope(s, 1), negate(coordinates.slope(s, 0), {range})}};
  }
  if (here.axis_count() == 1) {
    here.elaboration.sink.report("vector-operation", e.callee_range, {"curl", "one axis"},
                                 "a grid line for y adds an axis");
    return {};
  }
  const auto v = as_vector(here, value, e.arguments[0].value.range());
  if (!v) return {};
  const auto turn = [&](int a, int b) { return coordinates.rotation(*v, a, b); };
  if (here.axis_count() == 2) return number_of(turn(0, 1));
  return {TypedExpr::Type::vector, {turn(1, 2), turn(2, 0), turn(0, 1)}};
}

/// s k x v, with k normal to both axes.
TypedExpr cross_product(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 2)) return {};
  const auto s = as_number(here, any(here, e.arguments[0].value), e.arguments[0].value.range());
  const TypedExpr v = numeric(here, e.arguments[1].value);
  if (!s || v.type == TypedExpr::Type::none) return {};
  const bool is_flat = here.axis_count() == 2 &&
                       (!here.elaboration.problem.metric || is_literal(here.elaboration.problem.metric->around, 1));
  if (!is_flat) {
    here.elaboration.sink.report("vector-operation", e.callee_range, {"cross", counted(here.axis_count(), "axis")},
                                 "cross(s, v) is (-s*v.y, s*v.x), on two axes");
    return {};
  }
  const auto parts = as_vector(here, v, e.arguments[1].value.range());
  if (!parts) return {};
  return {TypedExpr::Type::vector, Coordinates(here.elaboration.problem, {range}).cross(*s, *parts)};
}

/// v|; for a number abs(v).
TypedExpr magnitude(FormulaScope& here, const ast::Expr& operand, SourceRange range) {
  const TypedExpr value = numeric(here, operand);
  if (value.type == TypedExpr::Type::number) return number_of(model::call(Fn::abs, {value.parts[0]}, {range}));
  return norm(value, range);
}

/// sqrt(dot(v, v)), with slope 0 at v = 0: there the root has infinite slope, so the root of 1 is computed but not
/// used.
TypedExpr norm(const TypedExpr& value, SourceRange range) {
  if (value.type == TypedExpr::Type::none) return {};
  const Origin origin{range};
  const Expr square = dot(value.parts, value.parts, origin);
  const Expr positive = binary(BinaryOp::greater, square, 0.0, origin);
  const Expr root = model::call(Fn::sqrt, {model::select(positive, square, 1.0, origin)}, origin);
  return number_of(model::select(positive, root, 0.0, origin));
}

}  // namespace formulas

}  // namespace dpde::model
