// SPDX-License-Identifier: Apache-2.0
#include "loop/float_order.h"

#include <algorithm>
#include <cmath>

#include "support/evaluate.h"
#include "support/match.h"

namespace dpde::loop {

namespace {

constexpr double far_from_1 = 0x1p63;  // the root of the largest float

double power_of(const FloatSize& size) {
  if (!size.value) return size.power;
  const double magnitude = std::max(std::abs(*size.value), 1 / std::abs(*size.value));
  if (*size.value == 0 || magnitude <= far_from_1) return 0;
  return magnitude <= far_from_1 * far_from_1 ? 1 : 2;  // no float
}

/// Of a sum, a choice or the like: the one farthest from 1.
FloatSize larger_of(const FloatSize& a, const FloatSize& b) {
  const double left = power_of(a), right = power_of(b);
  return {{}, std::abs(left) >= std::abs(right) ? left : right, a.stays && b.stays};
}

FloatSize size_of_call(const stencil::Call& c, const SizeOfLeaf& leaf) {
  const FloatSize first = float_size(c.arguments.front(), leaf);
  const FloatSize last = c.arguments.size() > 1 ? float_size(c.arguments.back(), leaf) : first;
  if (first.value && last.value) return {evaluate_call(c.fn, *first.value, *last.value)};
  if (c.fn == Fn::abs || c.fn == Fn::min || c.fn == Fn::max) return larger_of(first, last);
  return {{}, c.fn == Fn::sqrt ? power_of(first) / 2 : 0, first.stays && last.stays};
}

/// Divisors are divided by one factor after the other.
FloatSize size_of_divisor(const stencil::Expr& e, const SizeOfLeaf& leaf) {
  const auto* b = std::get_if<stencil::Binary>(&e->kind);
  const bool is_product = b != nullptr && b->op == BinaryOp::multiply;
  FloatSize size = float_size(e, leaf);
  if (is_product) size.stays = size_of_divisor(b->left, leaf).stays && size_of_divisor(b->right, leaf).stays;
  if (b != nullptr && b->op == BinaryOp::power) size.stays = float_size(b->left, leaf).stays;
  return size;
}

FloatSize size_of_binary(const stencil::Binary& b, const SizeOfLeaf& leaf) {
  const bool divides = b.op == BinaryOp::divide;
  const FloatSize left = float_size(b.left, leaf);
  const FloatSize right = divides ? size_of_divisor(b.right, leaf) : float_size(b.right, leaf);
  if (left.value && right.value) return {evaluate_binary(b.op, *left.value, *right.value)};
  const auto within = [&](double power) {
    const bool has_floats = !(left.value && power_of(left) > 1) && !(right.value && power_of(right) > 1);
    return FloatSize{{}, power, has_floats && left.stays && right.stays && std::abs(power) <= 1};
  };
  if (divides) return within(power_of(left) - power_of(right));
  if (b.op == BinaryOp::multiply) return within(power_of(left) + power_of(right));
  if (b.op == BinaryOp::power) return within(power_of(left) * right.value.value_or(1));
  return larger_of(left, right);
}

}  // namespace

FloatSize float_size(const stencil::Expr& e, const SizeOfLeaf& leaf) {
  return match(
      e->kind, [](const stencil::Literal& l) { return FloatSize{l.value}; },
      [&](const stencil::Param&) { return leaf(e); }, [&](const stencil::Local&) { return leaf(e); },
      [](const stencil::Access&) {
        return FloatSize{{}, 1};
      },
      [](const stencil::Interp&) {
        return FloatSize{{}, 1};
      },
      [](const stencil::Inside&) { return FloatSize{}; },
      [&](const stencil::Neg& n) {
        FloatSize size = float_size(n.operand, leaf);
        if (size.value) size.value = -*size.value;
        return size;
      },
      [&](const stencil::Binary& b) { return size_of_binary(b, leaf); },
      [&](const stencil::Call& c) { return size_of_call(c, leaf); },
      [&](const stencil::Select& s) { return larger_of(float_size(s.yes, leaf), float_size(s.no, leaf)); });
}

}  // namespace dpde::loop
