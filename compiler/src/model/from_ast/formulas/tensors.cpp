// SPDX-License-Identifier: Apache-2.0
// Tensors of two indices S_ij, i the component and j the direction: grad(v) is d v_i/dx_j, div(S) the sum over j of
// dS_ij/dx_j, and div(grad(v)) is lap(v). On one axis a number also counts as a tensor.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "model/boundary/metric.h"
#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/parts.h"
#include "model/from_ast/scene/coordinates.h"

namespace dpde::model {

namespace {

/// The sum of the products of components.
Expr contraction(const std::vector<Expr>& a, const std::vector<Expr>& b, const Origin& origin) {
  Expr sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum = binary(BinaryOp::add, sum, binary(BinaryOp::multiply, a[i], b[i], origin), origin);
  return sum;
}

std::vector<Expr> transposed(const std::vector<Expr>& s, std::size_t n) {
  std::vector<Expr> parts;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) parts.push_back(s[j * n + i]);
  }
  return parts;
}

std::vector<Expr> row_of(const std::vector<Expr>& s, std::size_t i, std::size_t n) {
  const auto begin = s.begin() + static_cast<std::ptrdiff_t>(i * n);
  return {begin, begin + static_cast<std::ptrdiff_t>(n)};
}

/// S v
std::vector<Expr> applied(const std::vector<Expr>& s, const std::vector<Expr>& v, const Origin& origin) {
  std::vector<Expr> parts;
  for (std::size_t i = 0; i < v.size(); ++i) parts.push_back(contraction(row_of(s, i, v.size()), v, origin));
  return parts;
}

/// Equal components become identical expressions.
std::vector<Expr> symmetric_part(const std::vector<Expr>& s, std::size_t n, const Origin& origin) {
  std::vector<Expr> parts;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const Expr &upper = s[std::min(i, j) * n + std::max(i, j)], &lower = s[std::max(i, j) * n + std::min(i, j)];
      const Expr sum = binary(BinaryOp::add, upper, lower, origin);
      parts.push_back(i == j ? upper : binary(BinaryOp::divide, sum, 2.0, origin));
    }
  }
  return parts;
}

/// Order of nested derivatives, ignoring those with a factor that vanishes fast enough towards poles.
int order_beside_poles(const Problem& problem, const Expr& e) {
  if (const auto* neg = as<Neg>(e)) return order_beside_poles(problem, neg->operand);
  const auto* b = as<Binary>(e);
  if (b != nullptr && (b->op == BinaryOp::add || b->op == BinaryOp::subtract))
    return std::max(order_beside_poles(problem, b->left), order_beside_poles(problem, b->right));
  const bool falls = b != nullptr && b->op == BinaryOp::multiply &&
                     (falls_towards_poles(problem, b->left) || falls_towards_poles(problem, b->right));
  return falls ? 0 : nested_order(e);
}

constexpr const char* takes_a_tensor = "it takes a tensor: grad(v) of a vector, outer(a, b), ((a, b), (c, d))";

}  // namespace

namespace formulas {

namespace {

TypedExpr scalar_product(FormulaScope& here, const std::vector<Expr>& a, const std::vector<Expr>& b, SourceRange range);

bool is_tensor(FormulaScope& here, const TypedExpr& value) {
  return value.type == TypedExpr::Type::tensor || (here.axis_count() == 1 && value.parts.size() == 1);
}

/// In a mean or a sum each product keeps its own placement if possible.
TypedExpr scalar_product(FormulaScope& here, const std::vector<Expr>& a, const std::vector<Expr>& b,
                         SourceRange range) {
  return number_of(here.is_in_sum ? contraction(a, b, {range})
                                  : Coordinates(here.elaboration.problem, {range}).dot(a, b));
}

/// With an axis of symmetry a tensor would also have a component around it.
bool can_take_tensor(FormulaScope& here, const std::string& what, SourceRange range) {
  const std::optional<Metric>& metric = here.elaboration.problem.metric;
  if (!metric || is_literal(metric->around, 1)) return true;
  here.elaboration.sink.report(
      "in-curved-coordinates", range, {what, metric->name},
      "there a tensor has a component around the axis of symmetry: write the terms of each component");
  return false;
}

/// The single argument, a tensor; `none` after a diagnostic.
TypedExpr tensor_argument(FormulaScope& here, const ast::Call& e) {
  if (!takes(here, e, 1)) return {};
  TypedExpr value = numeric(here, e.arguments[0].value);
  if (value.type == TypedExpr::Type::none || is_tensor(here, value)) return value;
  here.elaboration.sink.report("vector-operation", e.arguments[0].value.range(), {e.callee, "a " + describe(value)},
                               takes_a_tensor);
  return {};
}

}  // namespace

/// The identity tensor, which reads no values.
TypedExpr identity(FormulaScope& here) {
  TypedExpr result{TypedExpr::Type::tensor, {}};
  for (int i = 0; i < here.axis_count(); ++i) {
    for (int j = 0; j < here.axis_count(); ++j) result.parts.emplace_back(i == j ? 1.0 : 0.0);
  }
  result.unit = {{Measure::Kind::number}};
  return result;
}

/// ((a, b), (c, d)), one row per component, one column per axis.
TypedExpr rows(FormulaScope& here, const ast::Tuple& e) {
  TypedExpr result{TypedExpr::Type::tensor, {}};
  bool complete = static_cast<int>(e.elements.size()) == here.axis_count();
  if (!complete) {
    here.elaboration.sink.report("wrong-length", {e.elements.front().range().begin, e.elements.back().range().end},
                                 {counted(here.axis_count(), "row"), std::to_string(e.elements.size())},
                                 "a tensor has a row for each axis of the scene: ((a, b), (c, d)) on two");
    return {};
  }
  for (const ast::Expr& element : e.elements) {
    const auto row = as_vector(here, any(here, element), element.range());
    complete = complete && row;
    if (row) result.parts.insert(result.parts.end(), row->begin(), row->end());
  }
  return complete ? result : TypedExpr{};
}

TypedExpr outer_product(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 2)) return {};
  const auto a = as_vector(here, any(here, e.arguments[0].value), e.arguments[0].value.range());
  const auto b = as_vector(here, any(here, e.arguments[1].value), e.arguments[1].value.range());
  if (!a || !b) return {};
  TypedExpr result{TypedExpr::Type::tensor, {}};
  for (const Expr& of_a : *a) {
    for (const Expr& of_b : *b) result.parts.push_back(binary(BinaryOp::multiply, of_a, of_b, {range}));
  }
  return result;
}

/// The sum of the products of components of two numbers, vectors or tensors.
TypedExpr inner_product(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 2)) return {};
  const TypedExpr a = numeric(here, e.arguments[0].value), b = numeric(here, e.arguments[1].value);
  if (a.type == TypedExpr::Type::none || b.type == TypedExpr::Type::none) return {};
  if (a.parts.size() == b.parts.size()) return scalar_product(here, a.parts, b.parts, range);
  here.elaboration.sink.report(
      "wrong-length", e.arguments[1].value.range(),
      {counted(static_cast<int>(a.parts.size()), "component"), std::to_string(b.parts.size())});
  return {};
}

TypedExpr symmetric(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const TypedExpr value = tensor_argument(here, e);
  if (value.type == TypedExpr::Type::none) return {};
  const auto n = static_cast<std::size_t>(here.axis_count());
  return {TypedExpr::Type::tensor, symmetric_part(value.parts, n, {range})};
}

TypedExpr transpose(FormulaScope& here, const ast::Call& e, SourceRange) {
  const TypedExpr value = tensor_argument(here, e);
  if (value.type == TypedExpr::Type::none) return {};
  return {TypedExpr::Type::tensor, transposed(value.parts, static_cast<std::size_t>(here.axis_count()))};
}

TypedExpr trace(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const TypedExpr value = tensor_argument(here, e);
  if (value.type == TypedExpr::Type::none) return {};
  const auto n = static_cast<std::size_t>(here.axis_count());
  Expr sum = value.parts.front();
  for (std::size_t i = 1; i < n; ++i) sum = binary(BinaryOp::add, sum, value.parts[i * n + i], {range});
  return number_of(sum);
}

/// a . b: a number for two vectors, a vector for a tensor and a vector; the sum over the adjacent indices.
TypedExpr dot_product(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!takes(here, e, 2)) return {};
  const TypedExpr left = numeric(here, e.arguments[0].value), right = numeric(here, e.arguments[1].value);
  if (left.type == TypedExpr::Type::none || right.type == TypedExpr::Type::none) return {};
  const auto n = static_cast<std::size_t>(here.axis_count());
  const bool left_is_tensor = n > 1 && left.type == TypedExpr::Type::tensor,
             right_is_tensor = n > 1 && right.type == TypedExpr::Type::tensor;
  if (left_is_tensor && right_is_tensor) {
    here.elaboration.sink.report("vector-operation", range, {"dot", "two tensors"},
                                 "inner(S, T) is the sum of the products of components, dot(S, v) takes a vector");
    return {};
  }
  const std::size_t expected = left_is_tensor || right_is_tensor ? n : left.parts.size();
  const TypedExpr& vector = right_is_tensor ? left : right;
  if (vector.parts.size() != expected) {
    here.elaboration.sink.report(
        "wrong-length", e.arguments[right_is_tensor ? 0 : 1].value.range(),
        {counted(static_cast<int>(expected), "component"), std::to_string(vector.parts.size())});
    return {};
  }
  if (left_is_tensor) return {TypedExpr::Type::vector, applied(left.parts, right.parts, {range})};
  if (right_is_tensor) return {TypedExpr::Type::vector, applied(transposed(right.parts, n), left.parts, {range})};
  return scalar_product(here, left.parts, right.parts, range);
}

/// Next to poles lengths vary by their own size from row to row: a difference divided by a length has an O(1) error, a
/// flux has not.
void look_beside_poles(FormulaScope& here, const std::vector<Expr>& operand, int allowed, SourceRange range) {
  const auto is_deep = [&](const Expr& e) { return order_beside_poles(here.elaboration.problem, e) > allowed; };
  if (!has_pole(here.elaboration.problem) || std::ranges::none_of(operand, is_deep)) return;
  here.elaboration.sink.report(
      "beside-pole", range, {"a derivative of derivatives"},
      "lap(u) and div(k*grad(u)) of a number are right; elsewhere leave the rows next to poles out, by a "
      "factor as cos(lat)^2");
}

/// d v_i/dx_j
TypedExpr vector_gradient(FormulaScope& here, const std::vector<Expr>& v, SourceRange range) {
  if (!can_take_tensor(here, "grad of a vector", range)) return {};
  return {TypedExpr::Type::tensor, Coordinates(here.elaboration.problem, {range}).vector_gradient(v)};
}

TypedExpr tensor_divergence(FormulaScope& here, const std::vector<Expr>& s, SourceRange range) {
  if (!can_take_tensor(here, "div of a tensor", range)) return {};
  // Next to a pole the error is divided by the distance twice and does not decrease with the cell size.
  if (has_pole(here.elaboration.problem)) {
    here.elaboration.sink.report(
        "in-curved-coordinates", range, {"div of a tensor", "coordinates with a pole"},
        "lap(v) is div(grad(v)); let the axis end before the pole, or write the terms of each component");
    return {};
  }
  return {TypedExpr::Type::vector, Coordinates(here.elaboration.problem, {range}).tensor_divergence(s)};
}

/// S.xy of a name or of a parenthesised expression; `part` is "xy".
TypedExpr tensor_component(FormulaScope& here, const TypedExpr& whole, const ast::Identifier& part) {
  const int row = part.name.size() == 2 ? axis_of(part.name.substr(0, 1)) : -1;
  const int column = part.name.size() == 2 ? axis_of(part.name.substr(1)) : -1;
  if (row < 0 || column < 0) {
    here.elaboration.sink.report("unknown-axis", part.range, {part.name},
                                 "components of a tensor are called xx, xy, yx, ...");
    return {};
  }
  if (!has_axis(here, row, part.range) || !has_axis(here, column, part.range)) return {};
  return part_of(whole, row * here.axis_count() + column);
}

}  // namespace formulas

}  // namespace dpde::model
