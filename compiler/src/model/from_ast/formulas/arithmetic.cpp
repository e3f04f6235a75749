// SPDX-License-Identifier: Apache-2.0
// + - * / ^ of numbers, vectors and tensors. On one axis a number also counts as a vector and a tensor.
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"

namespace dpde::model {

namespace {

bool is_list(const TypedExpr& value) {
  return value.type == TypedExpr::Type::vector || value.type == TypedExpr::Type::tensor;
}

/// "two vectors", "a vector and a number", ...
std::string kinds_of(const TypedExpr& a, const TypedExpr& b) {
  const auto word = [](TypedExpr::Type type) {
    return type == TypedExpr::Type::tensor ? "tensor" : type == TypedExpr::Type::vector ? "vector" : "number";
  };
  if (a.type == b.type) return fmt::format("two {}s", word(a.type));
  return fmt::format("a {} and a {}", word(std::max(a.type, b.type)), word(std::min(a.type, b.type)));
}

/// The suggested form if the operation is undefined for a and b.
std::string list_hint(BinaryOp op, const TypedExpr& a, const TypedExpr& b) {
  const bool has_tensor = a.type == TypedExpr::Type::tensor || b.type == TypedExpr::Type::tensor;
  const bool has_number = a.type == TypedExpr::Type::number || b.type == TypedExpr::Type::number;
  if (op == BinaryOp::multiply || op == BinaryOp::power) {
    if (!has_tensor) return "dot(a, b) multiplies vectors";
    return a.type == b.type ? "inner(S, T) is the sum of the products of components"
                            : "dot(S, v) is S times a vector, dot(v, S) a vector times S";
  }
  if (op != BinaryOp::add && op != BinaryOp::subtract) return "";
  if (has_tensor) return has_number ? "p*identity is a tensor of a number" : "outer(a, b) is a tensor of vectors";
  return "a number may scale a vector, not be added to it; div(v) and dot(a, b) make numbers";
}

bool is_sum_of_squares(const Expr& e) {
  const auto* b = as<Binary>(e);
  if (b && b->op == BinaryOp::add) return is_sum_of_squares(b->left) && is_sum_of_squares(b->right);
  return b && b->op == BinaryOp::multiply && b->left == b->right;
}

/// v|^2, the sum of squares under the root of a norm; nullptr if `e` is not a norm.
const Expr* square_of(const Expr& e) {
  const auto* choice = as<Select>(e);
  const auto* positive = choice ? as<Binary>(choice->condition) : nullptr;
  const auto* root = choice ? as<Call>(choice->yes) : nullptr;
  if (!positive || !root || root->fn != Fn::sqrt || !is_literal(choice->no, 0)) return nullptr;
  const auto* inside = as<Select>(root->arguments.front());
  const bool is_norm = positive->op == BinaryOp::greater && is_literal(positive->right, 0) && inside &&
                       inside->condition == choice->condition && inside->yes == positive->left &&
                       is_sum_of_squares(positive->left);
  return is_norm ? &positive->left : nullptr;
}

}  // namespace

namespace formulas {

namespace {

TypedExpr scalar_operation(FormulaScope& here, BinaryOp op, const Operand& left, const Operand& right,
                           SourceRange range) {
  const auto a = as_number(here, left.value, left.source.range());
  const auto b = as_number(here, right.value, right.source.range());
  if (!a || !b) return {};
  const Expr* square = op == BinaryOp::power && is_literal(*b, 2) ? square_of(*a) : nullptr;  // no kink
  return number_of(square ? *square : binary(op, *a, *b, {range}));
}

}  // namespace

TypedExpr arithmetic(FormulaScope& here, BinaryOp op, const Operand& left, const Operand& right, SourceRange range) {
  if (!is_list(left.value) && !is_list(right.value)) return scalar_operation(here, op, left, right, range);
  for (const Operand* side : {&left, &right}) {
    if (side->value.type != TypedExpr::Type::condition) continue;
    as_number(here, side->value, side->source.range());
    return {};
  }
  const bool both = is_list(left.value) && is_list(right.value), alike = left.value.type == right.value.type;
  const bool scales = (op == BinaryOp::multiply && !both) || (op == BinaryOp::divide && !is_list(right.value));
  const bool is_on_one_axis = left.value.parts.size() == 1 && right.value.parts.size() == 1;
  const bool fits = scales || ((op == BinaryOp::add || op == BinaryOp::subtract) && alike);
  if (!fits && is_on_one_axis) return scalar_operation(here, op, left, right, range);
  if (!fits) {
    here.elaboration.sink.report("vector-operation", range,
                                 {fmt::format("'{}'", spelling(op)), kinds_of(left.value, right.value)},
                                 list_hint(op, left.value, right.value));
    return {};
  }
  if (both && left.value.parts.size() != right.value.parts.size()) {
    here.elaboration.sink.report(
        "wrong-length", right.source.range(),
        {counted(static_cast<int>(left.value.parts.size()), "component"), std::to_string(right.value.parts.size())});
    return {};
  }
  const std::size_t count = std::max(left.value.parts.size(), right.value.parts.size());
  TypedExpr result{is_list(left.value) ? left.value.type : right.value.type, {}};
  for (std::size_t i = 0; i < count; ++i) {
    const Expr& a = left.value.parts[is_list(left.value) ? i : 0];
    const Expr& b = right.value.parts[is_list(right.value) ? i : 0];
    result.parts.push_back(binary(op, a, b, {range}));
  }
  return result;
}

}  // namespace formulas

}  // namespace dpde::model
