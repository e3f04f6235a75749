// SPDX-License-Identifier: Apache-2.0
#include "stencil/space/upwind_difference.h"

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "stencil/build.h"
#include "stencil/space/finite_difference.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

constexpr double epsilon = 1e-6;
constexpr double smallest_rise = 1e-50;  // for weno in f64: the fifth power of its inverse is still finite

Expr square(const Expr& e) { return power(e, 2.0); }

Expr sum_of(const std::vector<Expr>& terms) {
  Expr sum = terms.front();
  for (std::size_t i = 1; i < terms.size(); ++i) sum = sum + terms[i];
  return sum;
}

/// A candidate of the weighted mean, with linear weight `share_of_all` and smoothness indicator `beta`.
struct Candidate {
  double share_of_all;
  Expr beta, difference;
};

/// In f32 the weights are multiplied by the square of the least divisor, which does not change the mean: their sum is
/// then near 1 instead of between 1 and 1e12.
Expr mean_of(const std::vector<Candidate>& candidates, const Share& share, Precision real) {
  const bool is_single = real == Precision::f32;
  std::vector<Expr> divisors, weights, terms;
  for (const Candidate& c : candidates) divisors.push_back(share("divisor", epsilon + c.beta));
  Expr least = divisors.front();
  for (const Expr& divisor : divisors) least = divisor == least ? least : call(Fn::min, {least, divisor});
  least = is_single ? share("least", least) : Expr(1.0);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const double part = candidates[i].share_of_all;
    const Expr weight = is_single ? part * square(least / divisors[i]) : part / square(divisors[i]);
    weights.push_back(share("weight", weight));
    terms.push_back(weights.back() * candidates[i].difference);
  }
  return sum_of(terms) / sum_of(weights);
}

std::vector<Candidate> candidates_of_3(const std::array<Expr, 3>& v, const std::array<Expr, 3>& r) {
  return {{1.0 / 3, square(r[1] - r[0]), (3.0 * v[1] - v[0]) / 2.0},
          {2.0 / 3, square(r[2] - r[1]), (v[1] + v[2]) / 2.0}};
}

std::vector<Candidate> candidates_of_5(const std::array<Expr, 5>& v, const std::array<Expr, 5>& r) {
  const auto beta = [](const Expr& bend, const Expr& slope) { return 13.0 / 12 * square(bend) + square(slope) / 4.0; };
  return {
      {0.1, beta(r[0] - 2.0 * r[1] + r[2], r[0] - 4.0 * r[1] + 3.0 * r[2]),
       (2.0 * v[0] - 7.0 * v[1] + 11.0 * v[2]) / 6.0},
      {0.6, beta(r[1] - 2.0 * r[2] + r[3], r[1] - r[3]), (5.0 * v[2] - v[1] + 2.0 * v[3]) / 6.0},
      {0.3, beta(r[2] - 2.0 * r[3] + r[4], 3.0 * r[2] - 4.0 * r[3] + r[4]), (2.0 * v[2] + 5.0 * v[3] - v[4]) / 6.0}};
}

/// Scales a size above 2^above by 2^by_above, and a size below 2^below by 2^by_below; else by 1.
struct Towards1 {
  double above, by_above, below, by_below;
  Expr of(const Expr& size) const {
    return select(binary(BinaryOp::greater, size, std::exp2(above)), std::exp2(by_above),
                  select(binary(BinaryOp::less, size, std::exp2(below)), std::exp2(by_below), 1.0));
  }
};
/// In sequence these steps scale f32 sizes from 2^-117 on to between 2^-6 and 2^6, so that all powers in derivatives
/// stay in range; the product of all scales is finite.
constexpr Towards1 scale_steps[] = {{48, -80, -48, 80}, {16, -32, -16, 32}, {5, -11, -5, 11}};

/// Below this size rises are not scaled and weights are linear: seeds of adjoints are divided by the scale, and must
/// stay finite.
constexpr double smallest_single_size = 0x1p-104;

/// Rises times a scale, and divided by the root of the sum of their squares.
template <std::size_t count>
struct ScaledRises {
  std::array<Expr, count> values, ratios;
  std::optional<Expr> scale = {};
};

template <std::size_t count>
std::array<Expr, count> times(std::array<Expr, count> values, const Expr& factor, const std::string& wish,
                              const Share& share) {
  for (Expr& value : values) value = share(wish, value * factor);
  return values;
}

template <std::size_t count>
ScaledRises<count> scaled_rises(const Rise& rise, const Share& share, Precision real) {
  const std::array<Expr, count> rises = [&]<std::size_t... k>(std::index_sequence<k...>) {
    return std::array<Expr, count>{rise(static_cast<int>(k) - static_cast<int>(count / 2))...};
  }
  (std::make_index_sequence<count>());
  ScaledRises<count> result{rises, rises};
  const bool is_single = real == Precision::f32;
  Expr size = 0.0;
  if (is_single) {
    std::vector<Expr> sizes;
    for (const Expr& value : result.values) sizes.push_back(call(Fn::abs, {value}));
    size = share("size", sum_of(sizes));
    Expr scale = scale_steps[0].of(size);
    for (const Towards1& step : {scale_steps[1], scale_steps[2]}) {
      scale = share("scale", scale);
      scale = scale * step.of(size * scale);
    }
    result.scale = share("scale", select(binary(BinaryOp::greater, size, smallest_single_size), scale, 1.0));
    result.values = times(result.values, *result.scale, "part", share);
  }
  std::vector<Expr> squares;
  for (const Expr& value : result.values) squares.push_back(square(value));
  const Expr sum = sum_of(squares);
  const Expr above_0 = is_single ? select(binary(BinaryOp::greater, size, smallest_single_size), sum, 1.0)
                                 : sum + smallest_rise * smallest_rise;
  const Expr scale = share("scale", 1.0 / call(Fn::sqrt, {above_0}));
  result.ratios = times(result.values, scale, "ratio", share);
  return result;
}

template <std::size_t count>
Expr unscaled(const Expr& mean, const ScaledRises<count>& rises) {
  return rises.scale ? mean / *rises.scale : mean;
}

struct Sizes {
  Expr a, b;
};
Sizes sizes_of(const Expr& a, const Expr& b, const Share& share) {
  return {share("size", call(Fn::abs, {a})), share("size", call(Fn::abs, {b}))};
}

/// The sum of the sizes, or 1 if it is smaller than `smallest`.
Expr divisor_of(const Sizes& size, double smallest, const Share& share) {
  const Expr sum = share("sum", size.a + size.b);
  return select(binary(BinaryOp::greater, sum, smallest), sum, 1.0);
}

/// 1 or -1 if both have this sign, 0 if the signs differ.
Expr common_sign(const Expr& a, const Expr& b) { return (call(Fn::sign, {a}) + call(Fn::sign, {b})) / 2.0; }

}  // namespace

UpwindDifference upwind_difference(int order, const Rise& rise) {
  require(order % 2 != 0, "upwind differences have odd orders");
  std::vector<int> places;
  for (int cell = -(order + 1) / 2; cell <= (order - 1) / 2; ++cell) places.push_back(2 * cell);
  const Difference taps = difference(1, places);
  // sum of w_i u_i = sum of (w_i + w_(i+1) + ...) (u_i - u_(i-1)), as the sum of all w is 0.
  UpwindDifference result{0.0, static_cast<double>(taps.denominator)};
  std::int64_t weight = 0;
  for (std::size_t i = taps.taps.size(); i-- > 1;) {
    weight += taps.taps[i].weight;
    const Expr term = static_cast<double>(std::abs(weight)) * rise(taps.taps[i].place / 2);
    result.sum = weight < 0 ? result.sum - term : result.sum + term;
  }
  return result;
}

Expr weno_difference(int order, const Rise& rise, const Share& share, Precision real) {
  require(order == 3 || order == 5, "there are weno(3) and weno(5)");
  if (order == 3) {
    const ScaledRises<3> rises = scaled_rises<3>(rise, share, real);
    return unscaled(mean_of(candidates_of_3(rises.values, rises.ratios), share, real), rises);
  }
  const ScaledRises<5> rises = scaled_rises<5>(rise, share, real);
  return unscaled(mean_of(candidates_of_5(rises.values, rises.ratios), share, real), rises);
}

Expr minmod_slope(const Expr& a, const Expr& b, const Share& share) {
  const Sizes size = sizes_of(a, b, share);
  return common_sign(a, b) * call(Fn::min, {size.a, size.b});
}

/// (a|b| + |a|b)/(|a| + |b|) is 2ab/(a + b) or 0.
Expr van_leer_slope(const Expr& a, const Expr& b, const Share& share) {
  const Sizes size = sizes_of(a, b, share);
  return (a * size.b + size.a * b) / divisor_of(size, 1e-100, share);
}

/// Both are divided by the root of the sum before they are multiplied. Derivatives contain 1/sum^(3/2), finite in f32.
Expr van_leer_slope_in_f32(const Expr& a, const Expr& b, const Share& share) {
  const Expr root = call(Fn::sqrt, {divisor_of(sizes_of(a, b, share), 1e-24, share)});
  const Expr scale = share("scale", 1.0 / root);
  const Expr a_part = share("part", a * scale), b_part = share("part", b * scale);
  return a_part * call(Fn::abs, {b_part}) + call(Fn::abs, {a_part}) * b_part;
}

Expr mc_slope(const Expr& a, const Expr& b, const Share& share) {
  const Sizes size = sizes_of(a, b, share);
  const Expr steepest = 2.0 * call(Fn::min, {size.a, size.b});
  return common_sign(a, b) * call(Fn::min, {steepest, (size.a + size.b) / 2.0});
}

Expr muscl_difference(Limiter limiter, const Rise& rise, const Share& share) {
  const Expr here = share("slope", limiter(rise(0), rise(1), share));
  const Expr upstream = share("slope", limiter(rise(-1), rise(0), share));
  return rise(0) + (here - upstream) / 2.0;
}

}  // namespace dpde::stencil
