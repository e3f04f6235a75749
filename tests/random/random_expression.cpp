// SPDX-License-Identifier: Apache-2.0
// Arguments of functions with jumps (if, sign, floor, fraction, slopes and cells of interpolation) are a single value
// with a generic number added: two sides that are equal but for rounding would make the results of two correct back
// ends differ. Operands are drawn in statements of their own, as the order of arguments is the C++ compiler's choice.
#include "random/random_expression.h"

#include <algorithm>

#include "stencil/build.h"

namespace dpde::testing {

using namespace stencil;

Expr ExpressionGenerator::number() {
  constexpr double numbers[] = {2, 3, 0.5, 0.25, 4, -1, -2, 1.5, 0.1, 6};
  return numbers[random_.below(std::size(numbers))];
}

Expr ExpressionGenerator::small_number() { return (1 + random_.below(900)) / 1000.0; }

Offset ExpressionGenerator::offset(const Readable& field) {
  Offset result{};
  if (random_.percent(35)) return result;
  const int moves = random_.percent(80) ? 1 : 2;
  for (int m = 0; m < moves; ++m) {
    const int axis = random_.below(rank());
    const int most = scope_.axes[axis] == Topology::periodic ? (field.is_around ? 3 : 0) : std::min(field.reach, 3);
    if (most == 0) continue;
    const int size = 1 + (random_.percent(70) ? 0 : random_.below(most));
    result[axis] = random_.percent(50) ? size : -size;
  }
  return result;
}

Expr ExpressionGenerator::read(const Readable& field) { return access(field.field, offset(field)); }

Expr ExpressionGenerator::leaf() {
  switch (random_.weighted({50, 15, 20, 15})) {
    case 0: return read(any_field());
    case 1: return param(scope_.params[random_.below(static_cast<int>(scope_.params.size()))]);
    case 2:
      return scope_.locals.empty() ? read(any_field())
                                   : local(scope_.locals[random_.below(static_cast<int>(scope_.locals.size()))]);
    default: return random_.percent(50) ? number() : small_number();
  }
}

/// Between -1 and 1, or little more.
Expr ExpressionGenerator::bounded(int depth) {
  switch (random_.below(4)) {
    case 0: return call(Fn::sin, {value(depth - 1)});
    case 1: return call(Fn::tanh, {value(depth - 1)});
    case 2: return call(Fn::cos, {value(depth - 1)});
    default: return call(Fn::atan, {value(depth - 1)});
  }
}

Expr ExpressionGenerator::function(int depth) {
  switch (random_.below(13)) {
    case 0: return call(Fn::tan, {0.6 * bounded(depth)});
    case 1: return call(Fn::asin, {0.6 * bounded(depth)});
    case 2: return call(Fn::acos, {0.6 * bounded(depth)});
    case 3: return call(Fn::sinh, {bounded(depth)});
    case 4: return call(Fn::cosh, {bounded(depth)});
    case 5: return call(Fn::exp, {bounded(depth)});
    case 6: return call(Fn::log, {power(value(depth - 1), 2.0) + 1.0});
    case 7: return call(Fn::sqrt, {positive(depth)});
    case 8: return call(Fn::abs, {value(depth - 1)});
    case 9: return call(Fn::min, {value(depth - 1), value(depth - 1)});
    case 10: return call(Fn::max, {value(depth - 1), value(depth - 1)});
    case 11: return jump();
    default: return bounded(depth);
  }
}

Expr ExpressionGenerator::jump() {
  const Readable& field = any_field();
  const Expr slope = number() + 0.37, start = small_number();
  const Expr argument = read(field) * slope + start;
  if (random_.percent(40)) return call(Fn::sign, {argument});
  // floor of what varies has no derivative and is refused: seldom
  if (random_.percent(50) && (!field.is_active || random_.percent(4))) return call(Fn::floor, {argument});
  return call(Fn::fraction, {argument});
}

Expr ExpressionGenerator::condition(int depth) {
  constexpr BinaryOp comparisons[] = {BinaryOp::less,          BinaryOp::less_equal, BinaryOp::greater,
                                      BinaryOp::greater_equal, BinaryOp::equal,      BinaryOp::not_equal};
  if (depth > 1 && random_.percent(25)) {
    const Expr left = condition(depth - 1), right = condition(depth - 1);
    return binary(random_.percent(50) ? BinaryOp::logical_and : BinaryOp::logical_or, left, right);
  }
  if (random_.percent(25)) {
    Offset k{};
    for (int axis = 0; axis < rank(); ++axis) k[axis] = random_.below(5) - 2;
    return inside(k, random_.below(3));
  }
  const Expr left = read(any_field());
  const BinaryOp comparison = comparisons[random_.weighted({4, 2, 4, 2, 1, 1})];
  return binary(comparison, left, random_.uniform(0.4, 1.6));
}

Expr ExpressionGenerator::positive(int depth) {
  const Expr least = small_number();
  return power(value(depth - 1), 2.0) + least;
}

Expr ExpressionGenerator::quotient(int depth) {
  const Expr above = value(depth - 1);
  switch (random_.below(4)) {
    case 0: return above / (1.5 + call(Fn::sin, {value(depth - 1)}));
    case 1: return above / (power(value(depth - 1), 2.0) + 1.0);
    case 2: return above / number();
    default: return above / power(param("hx"), random_.percent(50) ? 2.0 : 1.0);
  }
}

Expr ExpressionGenerator::powers(int depth) {
  const Expr base = positive(depth), exponent = bounded(depth);
  switch (random_.below(6)) {
    case 0: return power(leaf(), 2.0);
    case 1: return power(leaf(), 3.0);
    case 2: return power(base, 0.5 + 0.25 * random_.below(4));
    case 3: return power(1.3 + call(Fn::sin, {value(depth - 1)}), exponent);
    case 4: return power(1.0 + base, exponent);
    default: return power(base + 0.5, random_.percent(50) ? -1.0 : -2.0);
  }
}

Expr ExpressionGenerator::linear_stencil() {
  const Readable& field = any_field();
  Expr sum = random_.percent(50) ? -2.0 * access(field.field) : number() * access(field.field);
  for (int terms = 2 + random_.below(3); terms > 0; --terms) {
    const Expr weight = random_.percent(60) ? Expr(1.0) : number();
    const Expr term = weight * read(field);
    sum = random_.percent(70) ? sum + term : sum - term;
  }
  switch (random_.below(3)) {
    case 0: return sum;
    case 1: return sum / power(param("hx"), 2.0);
    default: return param(scope_.params[random_.below(static_cast<int>(scope_.params.size()))]) * sum;
  }
}

/// A read that is right only where inside[] says so.
Expr ExpressionGenerator::behind_inside() {
  const Readable& field = any_field();
  Offset k{};
  for (int axis = 0; axis < rank(); ++axis) {
    if (scope_.axes[axis] == Topology::bounded || field.is_around) k[axis] = random_.below(5) - 2;
  }
  const Expr outside = random_.percent(50) ? Expr(0.0) : leaf();
  return select(inside(k, random_.below(field.grown + 1)), access(field.field, k), outside);
}

Expr ExpressionGenerator::displacement() {
  switch (random_.weighted({3, 2, 4})) {
    case 0: return random_.below(5) - 2.0;
    case 1: return random_.uniform(-2.5, 2.5);
    default: break;
  }
  const Expr size = 0.3 + 2.0 * random_.below(2), phase = random_.uniform(0.0, 1.0), start = small_number();
  return size * call(Fn::sin, {value(1) + phase}) + start;
}

const Readable* ExpressionGenerator::interpolated_field() {
  const Readable& field = any_field();
  return field.interpolates ? &field : nullptr;
}

Interp ExpressionGenerator::place(const Readable& field) {
  Interp result{field.field, {}, {}, {}};
  for (int axis = 0; axis < rank(); ++axis) {
    result.offset[axis] = random_.percent(70) ? 0 : random_.below(5) - 2;
    result.displacement.push_back(displacement());
  }
  return result;
}

Expr ExpressionGenerator::two(BinaryOp op, int depth) {
  const Expr left = value(depth - 1), right = value(depth - 1);
  return binary(op, left, right);
}

Expr ExpressionGenerator::product(int depth) {
  const Expr factor = leaf(), other = value(depth - 1);
  return random_.percent(50) ? factor * other : other * factor;
}

Expr ExpressionGenerator::choice(int depth) {
  const Expr which = condition(depth), yes = value(depth - 1), no = value(depth - 1);
  return select(which, yes, no);
}

Expr ExpressionGenerator::value(int depth) {
  if (depth <= 0 || random_.percent(12)) return leaf();
  switch (random_.weighted({20, 12, 14, 8, 6, 14, 6, 10, 3, 5, 5})) {
    case 0: return two(BinaryOp::add, depth);
    case 1: return two(BinaryOp::subtract, depth);
    case 2: return product(depth);
    case 3: return quotient(depth);
    case 4: return powers(depth);
    case 5: return function(depth);
    case 6: return choice(depth);
    case 7: return linear_stencil();
    case 8: return -value(depth - 1);
    case 9: return behind_inside();
    default: break;
  }
  const Readable* field = interpolated_field();
  if (!field) return leaf();
  Interp at = place(*field);
  // Slopes jump at cell centres: only at generic places.
  for (int axis = 0; axis < rank() && random_.percent(25); ++axis) {
    at.along[axis] = static_cast<InterpolationBasis>(random_.below(along_count));
    if (at.along[axis] != InterpolationBasis::linear && at.along[axis] != InterpolationBasis::cubic)
      at.displacement[axis] = random_.uniform(-1.9, 1.9);
  }
  return interp(at);
}

Expr ExpressionGenerator::stored() {
  const Expr first = access(any_field().field), factor = leaf(), stencil = linear_stencil();
  switch (random_.below(4)) {
    case 0: return first + param("dt") * (stencil - factor * linear_stencil());
    case 1: return first + param("dt") * value(3);
    case 2: return stencil / 4.0;
    default: return bounded(3) * factor + (random_.percent(50) ? Expr(0.0) : first);
  }
}

int node_count(const Expr& e) {
  int count = 0;
  visit(e, [&](const Expr&) { ++count; });
  return count;
}

}  // namespace dpde::testing
