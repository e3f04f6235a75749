// SPDX-License-Identifier: Apache-2.0
// Derivatives by Fourier series against sums over all waves, along all sets of axes.
#include "transform/transform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include "dpde/runtime/layout.h"

namespace dpde {
namespace {

using Extents = std::array<int64_t, 3>;
using Axes = std::array<int32_t, 3>;

constexpr int powers[3] = {1, 2, 3};  // orders of the derivatives along each axis, which are summed

std::vector<double> arbitrary_field(std::size_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(-1, 1);
  std::vector<double> values(count);
  for (double& v : values) v = value(random);
  return values;
}

/// Entry (i, j), by i - j, of the differentiation matrix on a ring of n cells.
double weight(int64_t n, int power, int64_t difference) {
  double sum = 0;
  for (int64_t m = 0; m < n; ++m) {
    const double turn = 2 * std::numbers::pi * static_cast<double>(2 * m <= n ? m : m - n) / static_cast<double>(n);
    if (2 * m == n && power % 2 != 0) continue;  // mean over both signs
    const std::complex<double> wave = std::polar(1.0, turn * static_cast<double>(difference));
    sum += (std::pow(std::complex<double>(0, turn), power) * wave).real();
  }
  return sum / static_cast<double>(n);
}

std::vector<double> expected(const std::vector<double>& field, const Extents& cells, const Axes& axes) {
  std::vector<double> result(field.size(), 0.0);
  const Extents stride{1, cells[0], cells[0] * cells[1]};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axes[axis] == 0) continue;
    const int64_t n = cells[axis];
    for (int64_t d = 0; d < n; ++d) {
      const double w = weight(n, powers[axis], d);
      for (int64_t i = 0; i < static_cast<int64_t>(field.size()); ++i) {
        const int64_t at = i / stride[axis] % n, from = i + ((at - d + n) % n - at) * stride[axis];
        result[static_cast<std::size_t>(i)] += w * field[static_cast<std::size_t>(from)];
      }
    }
  }
  return result;
}

template <class Real>
std::vector<double> transformed(const std::vector<double>& field, const Extents& cells, const Axes& axes, int threads) {
  const int64_t halo = 3, rows = cells[0] + 2 * halo, size = rows * cells[1] * cells[2];
  dpde_layout layout{.rank = 3, .real = sizeof(Real) == 4 ? DPDE_F32 : DPDE_F64, .size = size, .origin = halo};
  const Extents stride{1, rows, rows * cells[1]};
  std::vector<dpde_monomial> monomials;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    layout.cells[axis] = cells[axis];
    layout.stride[axis] = stride[axis];
    dpde_monomial monomial{.uniform = DPDE_ONE};
    monomial.powers[axis] = powers[axis];
    if (axes[axis] != 0) monomials.push_back(monomial);
  }
  const dpde_transform_term term{.factor = {static_cast<int32_t>(monomials.size()), monomials.data()}};
  const dpde_transform transform{.term_count = 1, .terms = &term, .result = 1, .axes = {axes[0], axes[1], axes[2]}};
  std::vector<Real> from(static_cast<std::size_t>(size)), to(from.size());
  const auto place = [&](std::size_t i) {
    const auto number = static_cast<int64_t>(i);
    return static_cast<std::size_t>(halo + number % cells[0] + number / cells[0] * rows);
  };
  for (std::size_t i = 0; i < field.size(); ++i) from[place(i)] = static_cast<Real>(field[i]);
  void* const fields[]{from.data() + halo, to.data() + halo};
  for (Real& value : to) value = 7;
  FieldTransform work(transform, layout, Team(threads));
  work.run(fields, nullptr);
  work.run(fields, nullptr);
  EXPECT_EQ(to.front(), 7);
  std::vector<double> result;
  for (std::size_t i = 0; i < field.size(); ++i) result.push_back(static_cast<double>(to[place(i)]));
  return result;
}

TEST(FieldTransforms, AreThoseOfSumsOverAllWaves) {
  for (const Extents& cells :
       {Extents{8, 5, 1}, Extents{7, 6, 5}, Extents{1, 9, 4}, Extents{20, 1, 3}, Extents{33, 10, 2}}) {
    const std::vector<double> field = arbitrary_field(static_cast<std::size_t>(cells[0] * cells[1] * cells[2]));
    for (int set = 1; set < 8; ++set) {
      const Axes axes{set & 1, set >> 1 & 1, set >> 2 & 1};
      const std::vector<double> exact = expected(field, cells, axes);
      const std::vector<double> f64 = transformed<double>(field, cells, axes, 1),
                                f32 = transformed<float>(field, cells, axes, 1);
      for (std::size_t i = 0; i < exact.size(); ++i) {
        ASSERT_NEAR(f64[i], exact[i], 1e-11) << cells[0] << " " << cells[1] << " " << cells[2] << ", axes " << set;
        ASSERT_NEAR(f32[i], exact[i], 1e-4) << cells[0] << " " << cells[1] << " " << cells[2] << ", axes " << set;
      }
    }
  }
}

/// Two consecutive transforms of one field share its waves, unless the field changes in between.
TEST(FieldTransforms, OfOneFieldShareItsWaves) {
  constexpr int64_t n = 12;
  const dpde_layout layout{.rank = 1, .real = DPDE_F64, .cells = {n, 1, 1}, .stride = {1, n, n}, .size = n};
  const dpde_monomial first_power{DPDE_ONE, {1, 0, 0}}, second_power{DPDE_ONE, {2, 0, 0}};
  const dpde_transform_term slope_of{.factor = {1, &first_power}}, bend_of{.factor = {1, &second_power}};
  const dpde_transform slope{1, &slope_of, 1, {1, 0, 0}}, bend{1, &bend_of, 2, {1, 0, 0}},
      onto{1, &slope_of, 0, {1, 0, 0}};
  std::vector<double> field = arbitrary_field(n), by_slope(n), by_bend(n), alone(n);
  void* fields[]{field.data(), by_slope.data(), by_bend.data()};
  void* others[]{field.data(), by_slope.data(), alone.data()};
  for (const dpde_transform& before : {slope, onto}) {
    FieldTransform first(before, layout, Team(1)), second(bend, layout, Team(1), &first), single(bend, layout, Team(1));
    first.run(fields, nullptr);
    second.run(fields, nullptr);
    single.run(others, nullptr);
    EXPECT_EQ(by_bend, alone);
    EXPECT_NE(by_bend, std::vector<double>(n));
  }
}

TEST(FieldTransforms, AreTheSameByAnyNumberOfThreads) {
  const Extents cells{45, 32, 30};
  const std::vector<double> field = arbitrary_field(45 * 32 * 30);
  for (int set = 1; set < 8; ++set) {
    const Axes axes{set & 1, set >> 1 & 1, set >> 2 & 1};
    const std::vector<double> alone = transformed<double>(field, cells, axes, 1);
    for (const int threads : {2, 3}) EXPECT_EQ(transformed<double>(field, cells, axes, threads), alone) << set;
  }
}

}  // namespace
}  // namespace dpde
