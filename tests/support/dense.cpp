// SPDX-License-Identifier: Apache-2.0
#include "support/dense.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/maths/least_squares.h"

namespace dpde::test {

namespace {

PseudoInverse inverse_of(const DenseMatrix& a, double threshold) {
  dpde::DenseMatrix matrix(a.size);
  matrix.values = a.values;
  return {std::move(matrix), threshold};
}

}  // namespace

void multiply(const DenseMatrix& a, std::span<const double> x, std::span<double> result) {
  std::ranges::fill(result, 0.0);
  for (std::size_t j = 0; j < a.size; ++j) {
    for (std::size_t i = 0; i < a.size; ++i) result[i] += a.values[i + a.size * j] * x[j];
  }
}

std::vector<double> solution(const DenseMatrix& a, std::span<const double> b) {
  return inverse_of(a, 1e-12).solve({b.begin(), b.end()});
}

std::vector<double> regular_solution(const DenseMatrix& a, std::span<const double> b) {
  return inverse_of(a, 0).solve({b.begin(), b.end()});
}

/// Jacobi rotations (C. G. J. Jacobi 1846); each sets two entries to 0.
std::vector<double> symmetric_eigenvalues(DenseMatrix a) {
  for (int sweep = 0; sweep < 12; ++sweep) {
    for (std::size_t p = 0; p < a.size; ++p) {
      for (std::size_t q = p + 1; q < a.size; ++q) {
        if (std::abs(a(p, q)) < 1e-18 * (std::abs(a(p, p)) + std::abs(a(q, q)))) continue;
        const double angle = 0.5 * std::atan2(2 * a(p, q), a(q, q) - a(p, p));
        const double c = std::cos(angle), s = std::sin(angle);
        const auto rotate = [&](double& at_p, double& at_q) {
          const double before = at_p;
          at_p = c * before - s * at_q;
          at_q = s * before + c * at_q;
        };
        for (std::size_t i = 0; i < a.size; ++i) rotate(a(i, p), a(i, q));
        for (std::size_t i = 0; i < a.size; ++i) rotate(a(p, i), a(q, i));
      }
    }
  }
  std::vector<double> values(a.size);
  for (std::size_t i = 0; i < a.size; ++i) values[i] = a(i, i);
  std::ranges::sort(values);
  return values;
}

}  // namespace dpde::test
