// SPDX-License-Identifier: Apache-2.0
// Reductions against their definition, on grids smaller and larger than a block; bit-identical for any number of
// threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "test_program.h"

namespace dpde {
namespace {

using Cells = std::vector<int64_t>;

/// `values` reduced; x is fastest.
std::vector<double> run(int kind, const Cells& cells, std::array<int32_t, 3> over, const std::vector<double>& values,
                        int threads, int32_t real = DPDE_F64) {
  test::TestProgram program("reduce", static_cast<int>(cells.size()), {"u"}, {"m"});
  program.reduce(kind, "u", "m", over);
  dpde_program table = program.table();
  table.real = real;
  const dpde_layout layout = make_layout(cells, {2, cells.size() > 1 ? 1 : 0, cells.size() > 2 ? 1 : 0}, real);
  Field u(layout), m(layout);
  u.fill(std::nan(""));  // ghost cells are excluded
  u.copy_in(values);
  Executor executor(table, layout, threads);
  executor.bind(0, u.base());
  executor.bind(1, m.base());
  executor.run();
  std::vector<double> result(values.size());
  copy_out(layout, m.base(), result);
  return result;
}

/// By definition, one cell at a time, in extended precision.
std::vector<double> expected(int kind, Cells cells, std::array<int32_t, 3> over, const std::vector<double>& values) {
  cells.resize(3, 1);
  std::vector<double> result;
  for (int64_t z = 0; z < cells[2]; ++z) {
    for (int64_t y = 0; y < cells[1]; ++y) {
      for (int64_t x = 0; x < cells[0]; ++x) {
        long double sum = 0, count = 0;
        double most = -std::numeric_limits<double>::infinity(), least = -most;
        for (int64_t k = over[2] ? 0 : z; k < (over[2] ? cells[2] : z + 1); ++k) {
          for (int64_t j = over[1] ? 0 : y; j < (over[1] ? cells[1] : y + 1); ++j) {
            for (int64_t i = over[0] ? 0 : x; i < (over[0] ? cells[0] : x + 1); ++i) {
              const double value = values[static_cast<size_t>((k * cells[1] + j) * cells[0] + i)];
              sum += value;
              count += 1;
              most = std::max(most, value);
              least = std::min(least, value);
            }
          }
        }
        const double added = static_cast<double>(kind == DPDE_MEAN ? sum / count : sum);
        result.push_back(kind == DPDE_MAX ? most : kind == DPDE_MIN ? least : added);
      }
    }
  }
  return result;
}

std::vector<double> random_values(const Cells& cells) {
  size_t size = 1;
  for (const int64_t count : cells) size *= static_cast<size_t>(count);
  std::mt19937_64 random(size);
  std::uniform_real_distribution<double> between(-1, 2);
  std::vector<double> values(size);
  for (double& v : values) v = between(random);
  return values;
}

/// Calls f(cells, over, values) for each grid and each choice of axes.
template <class F>
void for_each_case(const std::vector<Cells>& grids, const F& f) {
  for (const Cells& cells : grids) {
    const std::vector<double> values = random_values(cells);
    for (int axes = 1; axes < 1 << cells.size(); ++axes) {
      SCOPED_TRACE(std::to_string(cells[0]) + " cells along x, axes " + std::to_string(axes));
      f(cells, std::array<int32_t, 3>{axes & 1, axes >> 1 & 1, axes >> 2 & 1}, values);
    }
  }
}

const std::vector<Cells> small{{1},    {2},    {7},    {8},      {9},       {300},     {2100},    {2100, 2}, {1, 1},
                               {5, 1}, {1, 6}, {3, 4}, {130, 3}, {1, 1, 1}, {2, 3, 4}, {9, 1, 2}, {1, 5, 3}};

TEST(Reduce, IsWhatItSays) {
  for_each_case(small, [](const Cells& cells, std::array<int32_t, 3> over, const std::vector<double>& values) {
    for (const int kind : {DPDE_MEAN, DPDE_SUM, DPDE_MAX, DPDE_MIN}) {
      const std::vector<double> found = run(kind, cells, over, values, 1), wanted = expected(kind, cells, over, values);
      const double tolerance = kind == DPDE_MAX || kind == DPDE_MIN ? 0 : 1e-13;
      for (size_t i = 0; i < wanted.size(); ++i)
        ASSERT_NEAR(found[i], wanted[i], tolerance * (1 + std::abs(wanted[i]))) << i;
    }
  });
}

/// The sum of a million floats of 0.1 in single precision would be 100958.
TEST(Reduce, AddsFloatsUpAsDoubles) {
  const std::vector<double> values(1000000, static_cast<double>(0.1f));
  for (const std::array<int32_t, 3> over : {std::array<int32_t, 3>{1, 1, 0}, std::array<int32_t, 3>{0, 1, 0}}) {
    const Cells cells = over[0] ? Cells{1000, 1000} : Cells{1, 1000000};
    EXPECT_EQ(run(DPDE_MEAN, cells, over, values, 1, DPDE_F32)[0], static_cast<double>(0.1f));
    EXPECT_EQ(run(DPDE_SUM, cells, over, values, 1, DPDE_F32)[0],
              static_cast<double>(static_cast<float>(1e6 * static_cast<double>(0.1f))));
  }
}

TEST(Reduce, DoesNotDependOnTheNumberOfThreads) {
  for_each_case({{70000}, {300, 200}, {1000, 40}, {5000, 12}, {3, 20000}, {40, 50, 60}},
                [](const Cells& cells, std::array<int32_t, 3> over, const std::vector<double>& values) {
                  const std::vector<double> one = run(DPDE_SUM, cells, over, values, 1);
                  for (const int threads : {2, 3, 5})
                    EXPECT_TRUE(run(DPDE_SUM, cells, over, values, threads) == one) << threads;
                });
}

TEST(Reduce, ANumberThatIsNoneShows) {
  for_each_case({{19}, {19, 3}}, [](const Cells& cells, std::array<int32_t, 3> over, std::vector<double> values) {
    for (const size_t place : {size_t{0}, values.size() / 2, values.size() - 1}) {
      std::vector<double> broken = values;
      broken[place] = std::nan("");
      for (const int kind : {DPDE_MEAN, DPDE_SUM, DPDE_MAX, DPDE_MIN})
        EXPECT_TRUE(std::isnan(run(kind, cells, over, broken, 1)[place]));
    }
  });
}

}  // namespace
}  // namespace dpde
