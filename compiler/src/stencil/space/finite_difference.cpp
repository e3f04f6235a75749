// SPDX-License-Identifier: Apache-2.0
// Fornberg's recursion in exact fractions. Up to order 12 the numbers are far below the limits of 64 bits.
#include "stencil/space/finite_difference.h"

#include <algorithm>
#include <numeric>

#include "support/assert.h"

namespace dpde::stencil {

namespace {

struct Fraction {
  std::int64_t top = 0;
  std::int64_t bottom = 1;  // > 0
};

Fraction reduced(std::int64_t top, std::int64_t bottom) {
  const std::int64_t divisor = std::gcd(top, bottom) * (bottom < 0 ? -1 : 1);
  return {top / divisor, bottom / divisor};
}

Fraction operator*(Fraction a, Fraction b) {
  // reduces crosswise first, so that the products are as small as possible
  const Fraction left = reduced(a.top, b.bottom);
  const Fraction right = reduced(b.top, a.bottom);
  return {left.top * right.top, left.bottom * right.bottom};
}

Fraction operator-(Fraction a, Fraction b) {
  const std::int64_t common = std::lcm(a.bottom, b.bottom);
  return reduced(a.top * (common / a.bottom) - b.top * (common / b.bottom), common);
}

/// weights[k][j]: weight of value j in the k-th derivative at 0, distances in half cells.
std::vector<std::vector<Fraction>> fornberg(int derivative, const std::vector<int>& places) {
  const int count = static_cast<int>(places.size());
  std::vector<std::vector<Fraction>> weights(derivative + 1, std::vector<Fraction>(count));
  weights[0][0] = {1, 1};
  Fraction product_before{1, 1};
  for (int i = 1; i < count; ++i) {
    Fraction product{1, 1};
    for (int j = 0; j < i; ++j) product = product * Fraction{places[i] - places[j], 1};
    for (int k = std::min(i, derivative); k >= 0; --k) {  // the new value, from the one before it
      const Fraction lower = k > 0 ? Fraction{k, 1} * weights[k - 1][i - 1] : Fraction{};
      const Fraction last = Fraction{places[i - 1], 1} * weights[k][i - 1];
      weights[k][i] = product_before * reduced(product.bottom, product.top) * (lower - last);
    }
    for (int j = 0; j < i; ++j) {
      for (int k = std::min(i, derivative); k >= 0; --k) {
        const Fraction lower = k > 0 ? Fraction{k, 1} * weights[k - 1][j] : Fraction{};
        const Fraction own = Fraction{places[i], 1} * weights[k][j];
        weights[k][j] = reduced(1, places[i] - places[j]) * (own - lower);
      }
    }
    product_before = product;
  }
  return weights;
}

std::vector<int> places_between(int low, int high) {
  std::vector<int> places;
  for (int place = low; place <= high; place += 2) places.push_back(place);
  return places;
}

}  // namespace

Difference difference(int derivative, const std::vector<int>& places) {
  require(derivative >= 0 && derivative < static_cast<int>(places.size()), "too few values for this derivative");
  std::vector<Fraction> weights = fornberg(derivative, places)[derivative];
  std::int64_t denominator = 1;
  for (Fraction& weight : weights) {
    weight = weight * Fraction{std::int64_t{1} << derivative, 1};  // from half cells to cells
    denominator = std::lcm(denominator, weight.bottom);
  }
  Difference result{{}, denominator, derivative};
  for (std::size_t j = 0; j < places.size(); ++j) {
    const std::int64_t weight = weights[j].top * (denominator / weights[j].bottom);
    if (weight != 0) result.taps.push_back({places[j], weight});
  }
  return result;
}

Difference central_difference(int derivative, int order) {
  require(derivative >= 1 && order >= 2 && order % 2 == 0, "central differences have even orders");
  const int reach = (derivative + 1) / 2 - 1 + order / 2;
  return difference(derivative, places_between(-2 * reach, 2 * reach));
}

Difference staggered_difference(int order) {
  require(order >= 2 && order % 2 == 0, "staggered differences have even orders");
  return difference(1, places_between(1 - order, order - 1));
}

Difference midpoint(int order) {
  require(order >= 2 && order % 2 == 0, "midpoints have even orders");
  return difference(0, places_between(1 - order, order - 1));
}

}  // namespace dpde::stencil
