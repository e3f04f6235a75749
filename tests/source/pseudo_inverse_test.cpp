// SPDX-License-Identifier: Apache-2.0
// The pseudo-inverse X of A is the one matrix with A*X*A = A and X*A*X = X for which A*X and X*A are symmetric
// (R. Penrose, A generalized inverse for matrices, 1955).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "support/maths/least_squares.h"

namespace dpde {
namespace {

DenseMatrix product(const DenseMatrix& a, const DenseMatrix& b) {
  DenseMatrix result(a.size);
  for (std::size_t j = 0; j < a.size; ++j) {
    for (std::size_t k = 0; k < a.size; ++k) {
      for (std::size_t i = 0; i < a.size; ++i) result.column(j)[i] += a.column(k)[i] * b.column(j)[k];
    }
  }
  return result;
}

double difference(const DenseMatrix& a, const DenseMatrix& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) most = std::max(most, std::abs(a.values[i] - b.values[i]));
  return most;
}

DenseMatrix transposed(const DenseMatrix& a) {
  DenseMatrix result(a.size);
  for (std::size_t i = 0; i < a.size; ++i) {
    for (std::size_t j = 0; j < a.size; ++j) result.column(i)[j] = a.column(j)[i];
  }
  return result;
}

/// A sum of products of a column and a row.
DenseMatrix of_rank(std::size_t rank, std::size_t size) {
  std::mt19937_64 random(rank * 100 + size);
  std::uniform_real_distribution<double> entry(-1, 1);
  DenseMatrix result(size);
  for (std::size_t term = 0; term < rank; ++term) {
    std::vector<double> column(size), row(size);
    for (auto* values : {&column, &row}) std::ranges::generate(*values, [&] { return entry(random); });
    for (std::size_t j = 0; j < size; ++j) {
      for (std::size_t i = 0; i < size; ++i) result.column(j)[i] += column[i] * row[j];
    }
  }
  return result;
}

TEST(PseudoInverse, IsTheOneOfPenrose) {
  for (const std::size_t size : {1, 2, 5, 9}) {
    for (std::size_t rank = 0; rank <= size; ++rank) {
      SCOPED_TRACE(testing::Message() << size << " rows, rank " << rank);
      const DenseMatrix a = of_rank(rank, size);
      const PseudoInverse inverse(a, 1e-12);
      DenseMatrix x(size);
      for (std::size_t j = 0; j < size; ++j) {
        std::vector<double> unit(size, 0.0);
        unit[j] = 1;
        std::ranges::copy(inverse.solve(unit), x.column(j).begin());
      }
      const DenseMatrix ax = product(a, x), xa = product(x, a);
      const double scale = 1 + difference(x, DenseMatrix(size));
      EXPECT_LT(difference(product(ax, a), a), 1e-12 * scale);
      EXPECT_LT(difference(product(xa, x), x), 1e-12 * scale * scale);
      EXPECT_LT(difference(ax, transposed(ax)), 1e-12 * scale);
      EXPECT_LT(difference(xa, transposed(xa)), 1e-12 * scale);
    }
  }
}

}  // namespace
}  // namespace dpde
