// SPDX-License-Identifier: Apache-2.0
// Signs of products that begin with a number, -2*a/b, for the constructors of levels: their binary(op, a, b).
#pragma once

#include <optional>

#include "support/expression.h"

namespace dpde {

template <class E>
bool is_product(const BinaryOf<E>& b) {
  return b.op == BinaryOp::multiply || b.op == BinaryOp::divide;
}

/// A product that begins with a number, with that number negated.
template <class Node>
std::optional<ExprOf<Node>> negate_leading_number(const ExprOf<Node>& e) {
  if (const Literal* number = as<Literal>(e)) return ExprOf<Node>(-number->value);
  const auto* b = as<BinaryOf<ExprOf<Node>>>(e);
  if (!b || !is_product(*b)) return std::nullopt;
  const std::optional<ExprOf<Node>> left = negate_leading_number(b->left);
  if (!left) return std::nullopt;
  return binary(b->op, *left, b->right);
}

template <class Node>
bool leads_with_minus(const ExprOf<Node>& e) {
  if (const Literal* number = as<Literal>(e)) return number->value < 0;
  const auto* b = as<BinaryOf<ExprOf<Node>>>(e);
  return b && is_product(*b) && leads_with_minus(b->left);
}

/// x when `e` is -x in any spelling.
template <class Node>
std::optional<ExprOf<Node>> without_minus(const ExprOf<Node>& e) {
  if (const auto* neg = as<NegOf<ExprOf<Node>>>(e)) return neg->operand;
  return leads_with_minus(e) ? negate_leading_number(e) : std::nullopt;
}

}  // namespace dpde
