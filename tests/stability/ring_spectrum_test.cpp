// SPDX-License-Identifier: Apache-2.0
// Wave by wave along a ring: the eigenvalues of the whole matrix, and none where cells of the ring differ.
#include "stability/waves/ring_spectrum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <complex>
#include <random>
#include <vector>

#include "stability/eigenvalues/eigenvalues.h"

namespace dpde::stability {
namespace {

/// Of two states, the same from each cell to the next along `axis`, and else anything.
Eigen::MatrixXd step_on_ring(const std::array<int, 3>& cells, int axis) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise;
  const int count = cells[0] * cells[1] * cells[2];
  Eigen::MatrixXd result(2 * count, 2 * count);
  int stride = 1;
  for (int a = 0; a < axis; ++a) stride *= cells[static_cast<std::size_t>(a)];
  const int length = cells[static_cast<std::size_t>(axis)];
  const auto turned = [&](int i) {  // the same a cell further
    const int place = i % count / stride % length;
    return place + 1 < length ? i + stride : i - place * stride;
  };
  for (int column = 0; column < result.cols(); ++column) {
    if (column % count / stride % length != 0) continue;
    for (int row = 0; row < result.rows(); ++row) {
      const double entry = noise(random) * (row < count ? 1e5 : 1) / (column < count ? 1e5 : 1);
      for (int i = 0, r = row, c = column; i < length; ++i, r = turned(r), c = turned(c)) result(r, c) = entry;
    }
  }
  return result;
}

TEST(RingSpectrum, HasTheEigenvaluesOfTheWholeMatrix) {
  for (const int axis : {0, 1}) {
    for (const int length : {1, 4, 5}) {
      std::array<int, 3> cells{3, 3, 2};
      cells[static_cast<std::size_t>(axis)] = length;
      const Eigen::MatrixXd step = step_on_ring(cells, axis);
      const auto found = eigenvalues_on_ring(step, cells, static_cast<std::size_t>(axis));
      ASSERT_TRUE(found.has_value());
      std::vector<std::complex<double>> left(found->begin(), found->end());
      for (const std::complex<double> value : eigenvalues(step)) {
        const auto nearest = std::ranges::min_element(left, {}, [&](auto v) { return std::abs(v - value); });
        ASSERT_NE(nearest, left.end());
        EXPECT_LT(std::abs(*nearest - value), 1e-10) << axis << " " << length;
        left.erase(nearest);
      }
      EXPECT_TRUE(left.empty());
    }
  }
}

/// Entries may be small because of another unit.
TEST(RingSpectrum, SeesACellThatIsNotAsTheOthers) {
  const std::array<int, 3> cells{4, 3, 1};
  Eigen::MatrixXd step = step_on_ring(cells, 0);
  step(13, 2) *= 1 + 1e-6;
  EXPECT_FALSE(eigenvalues_on_ring(step, cells, 0).has_value());
}

}  // namespace
}  // namespace dpde::stability
