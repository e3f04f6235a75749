// SPDX-License-Identifier: Apache-2.0
#include "stencil/space/quantities.h"

#include "model/build.h"
#include "stencil/build.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

/// top / bottom, with a uniform bottom.
struct Quotient {
  Expr top;
  Expr bottom;
  Expr value() const { return top / bottom; }
};

/// Placement of the summed expression; the cell centres if no field is staggered.
model::Placement home_of(const model::Expr& e, const model::Placements& placements) {
  return placements.is_staggered() ? placements.natural(e).value_or(model::Placement{}) : model::Placement{};
}

Quotient reduced(const model::Reduce& reduce, int rank, Discretiser& at_point) {
  Expr value = at_point(reduce.operand, home_of(reduce.operand, at_point.placements()));
  switch (reduce.reduction) {
    case model::Reduce::Kind::mean: return {value, param("cells")};
    case model::Reduce::Kind::sum: return {value, 1.0};
    case model::Reduce::Kind::integral:
      for (int axis = 0; axis < rank; ++axis) value = value * spacing(axis);
      return {value, 1.0};
    case model::Reduce::Kind::max:
    case model::Reduce::Kind::min: break;  // occur only inside a mean
  }
  unreachable("reduction");
}

Quotient share(const model::Expr& e, int rank, Discretiser& at_point) {
  if (const auto* reduce = as<model::Reduce>(e)) return reduced(*reduce, rank, at_point);
  if (!holds_any<model::Reduce>(e)) return {at_point(e), param("cells")};
  if (const auto* neg = as<model::Neg>(e)) {
    const Quotient positive = share(neg->operand, rank, at_point);
    return {-positive.top, positive.bottom};
  }
  const auto& b = std::get<model::Binary>(e->kind);
  if (b.op == BinaryOp::divide) {
    const Quotient left = share(b.left, rank, at_point);
    return {left.top, at_point(b.right) * left.bottom};
  }
  if (b.op == BinaryOp::multiply) {
    const bool factor_first = !holds_any<model::Reduce>(b.left);
    const Quotient rest = share(factor_first ? b.right : b.left, rank, at_point);
    return {scaled(at_point(factor_first ? b.left : b.right), rest.top), rest.bottom};
  }
  const Quotient left = share(b.left, rank, at_point);
  const Quotient right = share(b.right, rank, at_point);
  if (left.bottom == right.bottom) return {binary(b.op, left.top, right.top), left.bottom};
  return {binary(b.op, left.value(), right.value()), 1.0};
}

}  // namespace

Expr cell_share(const model::Expr& value, int rank, Discretiser& at_point) {
  return share(value, rank, at_point).value();
}

}  // namespace dpde::stencil
