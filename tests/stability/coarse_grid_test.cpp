// SPDX-License-Identifier: Apache-2.0
// Coarse grids for fields that depend on all points: restriction, interpolation and verdicts on them, and the scenes
// that keep their own grid.
#include "stability/step/coarse_grid.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stability/frozen/consistent_start.h"
#include "stability/frozen/zero_step.h"
#include "stability/report/verdict_cache.h"
#include "stability/stability_report.h"
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
                                                                  {{1026, 512}, {258, 512}},
                                                                  {{1 << 20, 1}, {1 << 18, 1}},
                                                                  {{128, 128, 128}, {64, 64, 64}},
                                                                  {{1001, 999}, {502, 500}}}) {
    const CoarseGrid grid(axes_of(cells, Topology::bounded));
    std::size_t all = 1;
    for (const int n : grid.cells()) all *= static_cast<std::size_t>(n);
    EXPECT_LE(all, std::size_t{1} << 18);
    EXPECT_EQ(grid.is_own(), cells == fewer);
    EXPECT_EQ(grid.cells(), fewer) << cells[0];
    EXPECT_TRUE(CoarseGrid::own(axes_of(cells, Topology::bounded)).is_own());
  }
}

/// From 700 x 600 cells: restriction conserves sums; smooth fields return with an error of order 2 in the cell width.
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
  }
}

/// What is linear is so on the faces of fewer cells, too, whether a face of these is one of the scene's or not.
TEST(CoarseGrid, TakesFacesToWhereFacesAre) {
  for (const std::vector<int>& cells : {std::vector<int>{700, 600}, {1001, 999}, {1026, 512}}) {
    const CoarseGrid grid(axes_of(cells, Topology::bounded));
    for (const std::size_t axis : {std::size_t{0}, std::size_t{1}}) {
      SCOPED_TRACE(fmt::format("{} cells along x, faces across {}", cells[0], "xy"[axis]));
      model::Placement placement{};
      placement[axis] = true;
      const auto faces_of = [&](const std::vector<int>& n) {
        std::vector<double> values;
        for (int j = 0; j < n[1]; ++j) {
          for (int i = 0; i < n[0]; ++i) values.push_back(3.0 * ((axis == 0 ? i : j) + 1) / n[axis] - 1);
        }
        return values;
      };
      const std::vector<double> own = faces_of(cells), fewer = faces_of(grid.cells());
      const std::vector<double> restricted = grid.restricted(own, placement),
                                prolonged = grid.prolonged(fewer, placement);
      ASSERT_EQ(restricted.size(), fewer.size());
      for (std::size_t i = 0; i < fewer.size(); ++i) ASSERT_NEAR(restricted[i], fewer[i], 1e-12) << i;
      for (std::size_t i = 0; i < own.size(); ++i) ASSERT_NEAR(prolonged[i], own[i], 1e-12) << i;
    }
  }
}

std::string vortices(int cells_of_x, int cells_of_y) {
  return fmt::format(
      "model m {{ field w; param nu\n solve lap(psi) = -w for psi\n let v = (dy(psi), -dx(psi))\n"
      " dt(w) = -advect(v, w) + nu*lap(w) }}\nscheme a {{ advect = central(2); time = rk4 }}\n"
      "scene s : m with a {{ grid x = 0 .. 1, cells {}\n grid y = 0 .. 1, cells {}\n nu = 1e-4\n boundary w: all = 0\n"
      " boundary psi: all = 0\n initial w = 200*exp(-60*((x - 0.3)^2 + (y - 0.4)^2))\n time 0 .. 1e-5, step 1e-6 }}\n",
      cells_of_x, cells_of_y);
}

/// The wind of a stream function on fewer cells is that of the scene's to the square of their width.
TEST(CoarseGrid, SolutionsOnItHaveTheSlopesOfThoseOnTheScenesCells) {
  const auto session = open_scene(vortices(600, 600));
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

/// Of 2^18 cells on its own grid, and of a few more on half as many, which are 0.4 % narrower along x. It is 2.3 %
/// lower (30 November 2026), on the safe side; where the other 1.9 % come from is not known.
TEST(CoarseGrid, VerdictsOnItAreThoseOfTheScenesOwn) {
  const auto own = open_scene(vortices(512, 512)), coarse = open_scene(vortices(514, 512));
  const StabilityReport of_own = verdict_of(*own), of_coarse = verdict_of(*coarse);
  EXPECT_TRUE(of_own.solution_cells.empty());
  EXPECT_EQ(of_coarse.solution_cells, (std::vector<int>{258, 512}));
  const std::optional<StabilityReport> kept = verdict_from(text_of(of_coarse));
  ASSERT_TRUE(kept.has_value());
  EXPECT_EQ(kept->solution_cells, of_coarse.solution_cells);
  ASSERT_EQ(of_own.limit.kind, StepLimit::Kind::limit);
  ASSERT_EQ(of_coarse.limit.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(of_coarse.limit.step / of_own.limit.step, 1, 0.03);
}

/// A flow that a constraint ties, or a stream function; `more` in the model, in rates and in the scene.
std::string flow(bool has_constraint, const std::string& in_model, const std::string& in_rates,
                 const std::string& in_scene) {
  const std::string grid = "grid x = 0 .. 1, cells 514\n grid y = 0 .. 1, cells 512\n",
                    time = "time 0 .. 1e-5, step 1e-6 }\n";
  return has_constraint
             ? "model m { vector u on faces; field p\n" + in_model + " dt(u) = -grad(p)" + in_rates +
                   "\n 0 = div(u) gives p }\nscheme a { time = euler }\n"
                   "scene s : m with a { " +
                   grid + in_scene +
                   " boundary u: all = 0\n initial u = (sin(pi*x)^2*sin(2*pi*y), -sin(2*pi*x)*sin(pi*y)^2)\n" + time
             : "model m { field w\n" + in_model + " solve lap(psi) = -w for psi\n dt(w) = psi - w" + in_rates +
                   " }\n"
                   "scheme a { time = euler }\nscene s : m with a { " +
                   grid + in_scene + " boundary w: all = 0\n boundary psi: all = 0\n initial w = x*y\n" + time;
}

TEST(CoarseGrid, IsTakenWhereFewerCellsShowTheSame) {
  struct Case {
    bool has_constraint;
    const char *in_model, *in_rates, *in_scene;
    bool is_own;
  };
  for (const Case& c : std::vector<Case>{
           {false, "", "", "", false},
           {false, "", " + mean(w)", "", false},
           {false, "", " + max(w)", "", true},
           {false, "mask q\n", " - q*w", "q = abs(x - 0.5) < 1e-3\n", true},
           {true, "", "", "", false},
           {true, "mask q\n u = 0 inside q\n", "", "q = abs(x - 0.5) < 1e-3\n", true},
           {true, "", "", "after step: u = 0.5*u\n", true},
       }) {
    const std::string text = flow(c.has_constraint, c.in_model, c.in_rates, c.in_scene);
    EXPECT_EQ(grid_of_solutions(*open_scene(text)).is_own(), c.is_own) << text;
  }
}

/// A start that fulfils its constraint to the square of the cells' width stays what it is, on faces too.
TEST(CoarseGrid, ConstraintsOnItLeaveWhatFulfilsThem) {
  const auto session = open_scene(flow(true, "", "", ""));
  for (int state = 0; state < session->rollout().state_count(); ++state) {
    const std::vector<double> given = session->initial(state);
    {
      const ConsistentStart start(*session);
      const std::vector<double> consistent = session->initial(state);
      double worst = 0;
      for (std::size_t i = 0; i < given.size(); ++i) worst = std::max(worst, std::abs(consistent[i] - given[i]));
      EXPECT_LT(worst, 1e-4) << session->rollout().state_name(state);
    }
    EXPECT_EQ(session->initial(state), given);
  }
}

}  // namespace
}  // namespace dpde::stability
