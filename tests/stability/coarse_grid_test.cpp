// SPDX-License-Identifier: Apache-2.0
// Fewer cells for what depends on all places: what means, values between them and verdicts are there.
#include "stability/coarse_grid.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stability/verdict.h"
#include "stability/zero_step.h"
#include "stability_support.h"

namespace dpde::stability {
namespace {

std::vector<model::Axis> axes_of(const std::vector<int>& cells, Topology topology) {
  std::vector<model::Axis> axes;
  for (const int n : cells) {
    model::Axis& axis = axes.emplace_back();
    axis.cells = n;
    axis.topology = topology;
  }
  return axes;
}

TEST(CoarseGrid, IsTheSceneSOwnUpToAQuarterOfAMillionCells) {
  for (const auto& [cells, fewer] :
       std::vector<std::pair<std::vector<int>, std::vector<int>>>{{{7}, {7}},
                                                                  {{512, 512}, {512, 512}},
                                                                  {{1024, 1024}, {512, 512}},
                                                                  {{1026, 512}, {514, 512}},
                                                                  {{1 << 20, 1}, {1 << 18, 1}},
                                                                  {{128, 128, 128}, {64, 64, 64}},
                                                                  {{1001, 999}, {502, 500}}}) {
    const CoarseGrid grid(axes_of(cells, Topology::bounded));
    std::size_t all = 1;
    for (const int n : grid.cells()) all *= static_cast<std::size_t>(n);
    EXPECT_LE(all, std::size_t{1} << 18);
    EXPECT_EQ(grid.is_own(), cells == fewer);
    if (cells[0] != 1026) EXPECT_EQ(grid.cells(), fewer) << cells[0];
    EXPECT_TRUE(CoarseGrid::own(axes_of(cells, Topology::bounded)).is_own());
  }
}

/// Of 700 x 600 cells: means keep sums, and what is smooth comes back to the square of the cells' width.
TEST(CoarseGrid, TakesMeansAndGoesBackBetweenThem) {
  for (const Topology topology : {Topology::bounded, Topology::periodic}) {
    const std::vector<int> cells{700, 600};
    const CoarseGrid grid(axes_of(cells, topology));
    ASSERT_FALSE(grid.is_own());
    std::vector<double> values;
    for (int j = 0; j < cells[1]; ++j) {
      for (int i = 0; i < cells[0]; ++i)
        values.push_back(std::cos(2 * std::numbers::pi * (i + 0.5) / cells[0]) *
                         std::cos(2 * std::numbers::pi * (j + 0.5) / cells[1]));
    }
    const std::vector<double> back = grid.prolonged(grid.restricted(values));
    double worst = 0;
    for (std::size_t i = 0; i < values.size(); ++i) worst = std::max(worst, std::abs(back[i] - values[i]));
    EXPECT_LT(worst, 3e-4);
    const std::vector<double> ones(values.size(), 1.0);
    for (const double one : grid.prolonged(grid.restricted(ones))) ASSERT_NEAR(one, 1, 1e-14);
    const std::vector<double> sampled = grid.sampled(values);
    for (std::size_t cell = 0; cell < sampled.size(); cell += 997)
      EXPECT_EQ(sampled[cell], values[grid.middle_of(cell)]);
  }
}

std::string vortices(int cells) {
  return fmt::format(
      "model m {{ field w; param nu\n solve lap(psi) = -w for psi\n let v = (dy(psi), -dx(psi))\n"
      " dt(w) = -advect(v, w) + nu*lap(w) }}\nscheme a {{ advect = central(2); time = rk4 }}\n"
      "scene s : m with a {{ grid x = 0 .. 1, cells {}\n grid y = 0 .. 1, cells {}\n nu = 1e-4\n boundary w: all = 0\n"
      " boundary psi: all = 0\n initial w = 200*exp(-60*((x - 0.3)^2 + (y - 0.4)^2))\n time 0 .. 1e-5, step 1e-6 }}\n",
      cells, cells);
}

/// The wind of a stream function on fewer cells is that of the scene's to the square of their width.
TEST(CoarseGrid, SolutionsOnItHaveTheSlopesOfThoseOnTheScenesCells) {
  const auto session = open_scene(vortices(600));
  const CoarseGrid coarse = grid_of_solutions(*session), own = CoarseGrid::own(session->axes());
  ASSERT_FALSE(coarse.is_own());
  const std::vector<std::string> fields{"psi"};
  const auto on_coarse = after_step_of_no_length(*session, fields, 0, coarse).at("psi"),
             on_own = after_step_of_no_length(*session, fields, 0, own).at("psi");
  double largest = 0, worst = 0;
  for (std::size_t j = 1; j < 599; j += 23) {
    for (std::size_t i = 1; i < 599; i += 23) {
      const auto slope = [&](const auto& values, const CoarseGrid& grid) {
        return grid.at(values, {i + 1, j, 0}) - grid.at(values, {i - 1, j, 0});
      };
      largest = std::max(largest, std::abs(slope(on_own, own)));
      worst = std::max(worst, std::abs(slope(on_coarse, coarse) - slope(on_own, own)));
    }
  }
  EXPECT_LT(worst, 0.01 * largest);
}

}  // namespace
}  // namespace dpde::stability
