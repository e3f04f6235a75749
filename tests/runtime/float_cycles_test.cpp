// SPDX-License-Identifier: Apache-2.0
// Multigrid cycles in single precision, as for scenes in f32: they reach the tolerances of f64.
#include "solve/multigrid/float_cycles.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "solve/solver/linear_solver.h"
#include "solve_operators.h"
#include "support/setting.h"

namespace dpde::test {
namespace {

/// Relative accuracy of matrix entries no better than floats.
constexpr double of_floats = 0x1p-29;

struct Solved {
  SolveReport report;
  std::vector<double> x;
  std::string reason;
  bool has_floats() const { return reason.find("f32") != std::string::npos; }
};

Solved solved(const std::shared_ptr<const GridOperator>& a, const SolveOptions& options, const std::vector<double>& b) {
  LinearSolver solver(a, options);
  Solved made{.x = std::vector<double>(b.size(), 0.0)};
  made.report = solver.solve(b, made.x);
  made.reason = solver.reason();
  return made;
}

double apart(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0, largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::abs(a[i] - b[i]));
    largest = std::max(largest, std::abs(b[i]));
  }
  return most / largest;
}

/// The middle quarter of each axis has another coefficient.
Coefficient with_jump(const GridCells& cells, double jump) {
  return [=](std::int64_t cell, std::size_t) {
    const std::int64_t place[] = {cell % cells[0], cell / cells[0] % cells[1], cell / cells[0] / cells[1]};
    bool is_inside = true;
    for (std::size_t axis = 0; axis < 3; ++axis)
      is_inside = is_inside && (cells[axis] == 1 || std::abs(8 * place[axis] + 4 - 4 * cells[axis]) < cells[axis]);
    return is_inside ? jump : 1;
  };
}

struct FloatCase {
  std::string what;
  GridCells cells;
  double shift;
  Coefficient k;
  bool is_hard = false;  // cycles alone need many iterations, and those of BiCGStab vary
};

std::vector<FloatCase> float_cases() {
  std::vector<FloatCase> cases;
  for (const GridCells& cells : {GridCells{300, 1, 1}, {40, 44, 1}, {37, 41, 1}, {12, 16, 14}, {13, 9, 10}}) {
    const auto add = [&](const char* what, double shift, const Coefficient& k, bool is_hard = false) {
      cases.push_back({fmt::format("{}, {} x {} x {}", what, cells[0], cells[1], cells[2]), cells, shift, k, is_hard});
    };
    add("one row", 0, constant_one);
    add("uneven", 0, uneven);
    add("screened", 1e4, uneven);
    add("hardly screened", 0.01, constant_one);
    add("stronger along x", 0, [](std::int64_t, std::size_t axis) { return axis == 0 ? 25 : 1; });
    add("a jump up", 0, with_jump(cells, 1e6), true);
    add("a jump down", 0, with_jump(cells, 1e-6), true);
  }
  return cases;
}

/// A right-hand side with long and short waves; x has the largest rounding for the long ones.
std::vector<double> right_side(const FloatCase& one, const GridOperator& a) {
  std::vector<double> b = arbitrary_values(a.size(), 3);
  for (std::size_t i = 0; i < b.size(); ++i)
    b[i] = 0.01 * b[i] + 1 + std::cos(3 * static_cast<double>(i) / static_cast<double>(b.size()) + one.shift);
  a.null_space().remove(b);
  return b;
}

/// Same accuracy as doubles, compared with a direct solve, with at most a few cycles more.
TEST(FloatCycles, ComeAsNearAsDoubles) {
  std::size_t number = 0;
  for (const FloatCase& one : float_cases()) {
    for (const auto& walls : all_walls) {
      if (!testing::is_tried(number++, 5)) continue;
      const StencilMatrix matrix = diffusion(one.cells, {walls, all_walls[2], walls}, one.shift, one.k);
      const auto a = std::make_shared<GridOperator>(matrix, 0x1p-52);
      const std::vector<double> b = right_side(one, *a);
      const Solved exact = solved(a, {.method = SolverMethod::direct}, b);
      for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::cg, SolverMethod::bicgstab}) {
        SolveOptions options{.method = method, .tolerance = 1e-10};
        const Solved doubles = solved(a, options, b);
        options.rounding = of_floats;
        const Solved floats = solved(a, options, b);
        const std::string what = fmt::format("{}: {}", one.what, name_of(method));
        if (!one.is_hard && one.cells[1] > 1) EXPECT_TRUE(floats.has_floats()) << what << ": " << floats.reason;
        EXPECT_FALSE(doubles.has_floats()) << what;
        EXPECT_TRUE(floats.report.converged || !doubles.report.converged) << what;
        if (doubles.report.converged)
          EXPECT_LE(floats.report.residual, 1.01 * std::max(floats.report.bound, doubles.report.residual)) << what;
        if (!one.is_hard || method == SolverMethod::cg)
          EXPECT_LE(floats.report.iterations, doubles.report.iterations + 4 + doubles.report.iterations / 4) << what;
        if (doubles.report.converged)
          EXPECT_LE(apart(floats.x, exact.x), 10 * apart(doubles.x, exact.x) + 1e-8) << what;
      }
    }
  }
  EXPECT_GT(number, 100);
}

/// Disconnected parts of a grid, each with its own mean, and cells without an equation.
TEST(FloatCycles, GoAroundWhatIsCutOff) {
  const GridCells cells{48, 40, 1};
  const auto k = [&](std::int64_t cell, std::size_t axis) {
    const std::int64_t x = cell % cells[0], y = cell / cells[0];
    const auto is_solid = [](std::int64_t i, std::int64_t j) { return (i / 4 == 6) || (i < 8 && j > 30); };
    return is_solid(x, y) || is_solid(x + (axis == 0), y + (axis == 1)) ? 0.0 : 1.0;
  };
  const auto a =
      std::make_shared<GridOperator>(diffusion(cells, {all_walls[2], all_walls[2], all_walls[0]}, 0, k), 0x1p-52);
  std::vector<double> b = arbitrary_values(a->size(), 5);
  for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::cg}) {
    SolveOptions options{.method = method, .tolerance = 1e-11};
    const Solved doubles = solved(a, options, b);
    options.rounding = of_floats;
    const Solved floats = solved(a, options, b);
    EXPECT_TRUE(floats.has_floats());
    EXPECT_TRUE(doubles.report.converged && floats.report.converged) << name_of(method);
    EXPECT_LE(floats.report.iterations, doubles.report.iterations + 4) << name_of(method);
    EXPECT_LE(apart(floats.x, doubles.x), 1e-9) << name_of(method);
  }
}

/// Right-hand sides and operators of any scale: cycles are scaled to about 1. If the coefficients' ratios exceed the
/// range of floats, doubles are used.
TEST(FloatCycles, KnowNoUnits) {
  const GridCells cells{40, 44, 1};
  const StencilMatrix whole = diffusion(cells, {all_walls[1], all_walls[3], all_walls[0]}, 0, uneven);
  const std::vector<double> b = arbitrary_values(whole.size(), 5);
  for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::cg, SolverMethod::bicgstab}) {
    std::optional<std::vector<double>> first;
    for (const double factor : {1.0, -0x1p-200, 0x1p200}) {
      for (const double size : {1.0, 0x1p-150, 0x1p150}) {
        StencilMatrix matrix = whole;
        for (auto& column : matrix.values) std::ranges::for_each(column, [&](double& value) { value *= factor; });
        std::vector<double> right = b;
        for (double& value : right) value *= size;
        Solved made = solved(std::make_shared<GridOperator>(matrix, 0x1p-52),
                             {.method = method, .tolerance = 1e-9, .rounding = of_floats}, right);
        EXPECT_TRUE(made.has_floats() && made.report.converged) << name_of(method) << factor << " " << size;
        for (double& value : made.x) value *= factor / size;
        if (!first) first = made.x;
        EXPECT_EQ(made.x, *first) << name_of(method) << factor << " " << size;
      }
    }
  }
  const auto far_apart = [&](std::int64_t cell, std::size_t axis) { return with_jump(cells, 1e-25)(cell, axis); };
  const auto a = std::make_shared<GridOperator>(
      diffusion(cells, {all_walls[1], all_walls[1], all_walls[0]}, 0, far_apart), 0x1p-52);
  EXPECT_FALSE(solved(a, {.method = SolverMethod::cg, .rounding = of_floats}, b).has_floats());
}

/// Cases for which floats are not sufficient: a mean determined by 1e-10 of a diagonal, and coefficients of very
/// different size. Doubles take over and reach the same accuracy as alone, also in later solves and for other
/// coefficients in the same memory.
TEST(FloatCycles, GiveUpToDoubles) {
  const GridCells cells{40, 44, 1};
  std::vector<std::pair<std::string, StencilMatrix>> operators;
  operators.emplace_back("held by little", diffusion(cells, {all_walls[2], all_walls[2], all_walls[0]}, 1e-6, uneven));
  for (const double jump : {1e-9, 1e-6, 1e-5, 1e6, 1e9, 1e12}) {
    operators.emplace_back(fmt::format("a jump of {}", jump),
                           diffusion(cells, {all_walls[1], all_walls[1], all_walls[0]}, 0, with_jump(cells, jump)));
  }
  int given_up = 0;
  for (const auto& [what, matrix] : operators) {
    const auto a = std::make_shared<GridOperator>(matrix, 0x1p-52);
    std::vector<double> b = arbitrary_values(a->size(), 5);
    for (double& value : b) value += 1;
    for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::cg, SolverMethod::bicgstab}) {
      const std::string row = fmt::format("{}: {}", what, name_of(method));
      SolveOptions options{.method = method, .tolerance = 1e-8};
      const Solved doubles = solved(a, options, b);
      options.rounding = of_floats;
      LinearSolver solver(a, options);
      for (int turn = 0; turn < 3; ++turn) {
        std::vector<double> x(b.size(), 0.0);
        const SolveReport report = solver.solve(b, x);
        EXPECT_TRUE(report.converged || !doubles.report.converged) << row << ", turn " << turn;
        if (doubles.report.converged) EXPECT_LE(report.residual, report.bound) << row;
        if (turn == 1) EXPECT_TRUE(solver.renew(std::make_shared<GridOperator>(matrix, 0x1p-52))) << row;
      }
      given_up += solver.reason().find("f32") == std::string::npos ? 1 : 0;
    }
  }
  EXPECT_GT(given_up, 2);
}

}  // namespace
}  // namespace dpde::test
