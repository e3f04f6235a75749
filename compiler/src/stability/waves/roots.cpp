// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/roots.h"

#include <cmath>

#include "stability/eigenvalues/hessenberg.h"
#include "support/assert.h"

namespace dpde::stability {

namespace {

using Root = std::complex<double>;

std::array<Root, most_roots> roots_of_quadratic(const Root& c0, const Root& c1) {
  const Root half = -0.5 * c1, root = std::sqrt(product(half, half) - c0);
  // The larger root has no cancellation; the other follows from the product c0.
  const Root larger = std::norm(half + root) >= std::norm(half - root) ? half + root : half - root;
  return {larger, larger == 0.0 ? 0.0 : c0 / larger, 0};
}

/// One Newton step towards the nearby root, taken only if it is small.
Root refined(const Root& x, const Root& c0, const Root& c1, const Root& c2) {
  const Root value = product(product(x + c2, x) + c1, x) + c0, slope = product(3.0 * x + 2.0 * c2, x) + c1;
  const Root change = value / slope;
  return std::norm(change) < 1e-8 * std::norm(x) ? x - change : x;
}

/// By Cardano's formula: x + c2/3 has the cubic y^3 + p y + q.
std::array<Root, most_roots> roots_of_cubic(const Root& c0, const Root& c1, const Root& c2) {
  const Root mean = -c2 / 3.0, square = product(mean, mean);
  const Root p = c1 - 3.0 * square, q = c0 + product(mean, c1) - 2.0 * product(mean, square);
  const Root third = p / 3.0, root = std::sqrt(0.25 * product(q, q) + product(third, product(third, third)));
  const Root sum = std::norm(-0.5 * q + root) >= std::norm(-0.5 * q - root) ? -0.5 * q + root : -0.5 * q - root;
  if (sum == 0.0) return {mean, mean, mean};
  Root u = std::polar(std::cbrt(std::abs(sum)), std::arg(sum) / 3);
  const Root turn(-0.5, 0.5 * std::sqrt(3.0));
  std::array<Root, most_roots> roots;
  for (Root& x : roots) {
    x = refined(mean + u - third / u, c0, c1, c2);
    u = product(u, turn);
  }
  return roots;
}

}  // namespace

std::array<std::complex<double>, most_roots> roots_of(std::span<const std::complex<double>> c) {
  require(!c.empty() && c.size() <= most_roots, "a polynomial of low degree");
  if (c.size() == 1) return {-c[0], 0, 0};
  return c.size() == 2 ? roots_of_quadratic(c[0], c[1]) : roots_of_cubic(c[0], c[1], c[2]);
}

}  // namespace dpde::stability
