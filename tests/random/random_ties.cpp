// SPDX-License-Identifier: Apache-2.0
#include "random/random_ties.h"

#include <algorithm>

#include "stencil/build.h"

namespace dpde::testing {

using namespace stencil;

namespace {

Expr at(const Expr& e, const Offset& k) {
  return shift(e, k, [](const std::string& name) { return name; });
}

/// Products and sums of what a contraction or a regrouping would change the last bit of.
Expr speed(SplitMix& random, const std::vector<Readable>& fields) {
  const auto any = [&] {
    return access(fields[static_cast<std::size_t>(random.below(static_cast<int>(fields.size())))].field);
  };
  const Expr a = any(), b = any(), c = random.uniform(0.3, 1.7), dt = param("dt");
  switch (random.below(6)) {
    case 0: return call(Fn::abs, {a / (1.5 + power(b, 2.0))}) + call(Fn::sqrt, {1.0 + c * power(a, 2.0)});
    case 1: return c * power(a, 2.0) + b * b * 0.7;
    case 2: return call(Fn::sqrt, {power(a, 2.0) + c * power(b, 2.0) + 0.3});
    case 3: return call(Fn::abs, {a}) * c + a * b * dt * 0.3 / param("hx");
    case 4: return (a - dt * b * c) * (1.0 + 0.3 * a);
    default: return a * a * a - c * b;
  }
}

/// One of two values, by how they compare.
Expr chosen(SplitMix& random, const Expr& one, const Expr& other) {
  switch (random.below(6)) {
    case 0: return call(Fn::max, {one, other});
    case 1: return call(Fn::min, {one, other});
    case 2: return select(binary(BinaryOp::greater, one, other), one, other);
    case 3: return select(binary(BinaryOp::less_equal, one, other), one * 1.5, other + 0.5 * one);
    case 4: return call(Fn::abs, {one - other}) + one + other;
    default:
      return select(binary(BinaryOp::less, one * other, 0.0), 0.0,
                    call(Fn::min, {call(Fn::abs, {one}), call(Fn::abs, {other})}));
  }
}

/// The choices of both sides are drawn alike: `twin` is the generator as it was for the first one.
Expr flux_difference(SplitMix& random, const Expr& q, const Expr& s, const Offset& up, const Offset& down) {
  SplitMix twin = random;
  const Expr above = chosen(random, s, at(s, up)), below = chosen(twin, at(s, down), s);
  return above * (at(q, up) - q) - below * (q - at(q, down));
}

Expr limited_slope(SplitMix& random, const Expr& q, const Expr& s, const Offset& up, const Offset& down) {
  return chosen(random, at(s, up) - s, s - at(s, down)) * q;
}

}  // namespace

Expr tie(SplitMix& random, const Scope& scope) {
  const int axis = random.below(static_cast<int>(scope.axes.size()));
  std::vector<Readable> fields;
  std::ranges::copy_if(scope.fields, std::back_inserter(fields), [&](const Readable& field) {
    return field.is_active &&
           (scope.axes[static_cast<std::size_t>(axis)] == Topology::periodic ? field.is_around : field.reach > 0);
  });
  if (fields.empty()) return 0.0;
  Offset up{}, down{};
  up[static_cast<std::size_t>(axis)] = 1;
  down[static_cast<std::size_t>(axis)] = -1;
  const Expr q = access(fields[static_cast<std::size_t>(random.below(static_cast<int>(fields.size())))].field),
             s = speed(random, fields);
  return random.percent(70) ? flux_difference(random, q, s, up, down) : limited_slope(random, q, s, up, down);
}

}  // namespace dpde::testing
