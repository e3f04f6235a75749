// SPDX-License-Identifier: Apache-2.0
// Linear solvers for singular or nearly singular operators, odd extents, and non-finite right-hand sides.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "allocations.h"
#include "dpde/runtime/error.h"
#include "solve/solver/linear_solver.h"
#include "solve/solver/solver_shelf.h"
#include "solve_operators.h"

namespace dpde {

using namespace test;

namespace {

using Walls = std::array<std::pair<Wall, Wall>, 3>;
const Walls rings{all_walls[0], all_walls[0], all_walls[0]}, slopes{all_walls[2], all_walls[2], all_walls[0]},
    values{all_walls[1], all_walls[1], all_walls[0]};

std::string refusal_of(const StencilMatrix& matrix, SolverMethod method) {
  try {
    LinearSolver(matrix, {.method = method});
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// x - k*lap(x) = 1 has the solution 1, also if entries have only the digits of f32.
TEST(LinearSolverLimits, SinglePrecisionKeepsTheMean) {
  for (const double k : {2e4, 2e5}) {
    for (const Walls& walls : {rings, slopes}) {
      StencilMatrix matrix = diffusion({40, 40, 1}, walls, 1, [&](auto, auto) { return k / 1600; });
      for (auto& column : matrix.values) {
        for (double& value : column) value = static_cast<double>(static_cast<float>(value));
      }
      for (const SolverMethod method : {SolverMethod::automatic, SolverMethod::fourier, SolverMethod::direct,
                                        SolverMethod::multigrid, SolverMethod::cg}) {
        const std::vector<double> b(1600, 1.0);
        std::vector<double> x(1600, 0.0);
        LinearSolver solver(matrix, {.method = method, .rounding = 0x1p-23});
        const SolveReport report = solver.solve(b, x);
        EXPECT_TRUE(report.converged) << name_of(method);
        EXPECT_EQ(report.incompatible, 0) << name_of(method);
        EXPECT_NEAR(x[77], 1, 0.2) << name_of(method) << " " << k;  // the diagonal resolves 1 to 1/16 only
      }
    }
  }
}

/// An operator that is singular up to the digits of f32 gives the mean 0.
TEST(LinearSolverLimits, SinglePrecisionIsSingular) {
  StencilMatrix matrix = diffusion({24, 17, 1}, slopes, 0, uneven);
  for (auto& column : matrix.values) {
    for (double& value : column) value = static_cast<double>(static_cast<float>(value / 3));
  }
  const std::vector<double> b = arbitrary_values(matrix.size(), 8);
  for (const SolverMethod method : {SolverMethod::direct, SolverMethod::multigrid, SolverMethod::cg}) {
    std::vector<double> x(b.size(), 0.0);
    LinearSolver solver(matrix, {.method = method, .rounding = 0x1p-23});
    const SolveReport report = solver.solve(b, x);
    EXPECT_TRUE(report.converged) << name_of(method);
    EXPECT_GT(report.incompatible, 0) << name_of(method);
    double sum = 0;
    for (const double value : x) sum += value;
    EXPECT_NEAR(sum, 0, 1e-10) << name_of(method);
  }
}

/// Long waves are resolved in f32, too.
TEST(LinearSolverLimits, SinglePrecisionKeepsLongWaves) {
  const std::int64_t n = 2048;
  StencilMatrix matrix = diffusion({n, 1, 1}, rings, 0, [](auto, auto) { return 1.0; });
  std::vector<double> b(n), x(n, 0.0);
  const double turn = 2 * std::numbers::pi / static_cast<double>(n);
  for (std::size_t i = 0; i < b.size(); ++i) b[i] = std::cos(turn * static_cast<double>(i));
  LinearSolver(matrix, {.method = SolverMethod::fourier, .rounding = 0x1p-23}).solve(b, x);
  EXPECT_NEAR(x[0] * (2 - 2 * std::cos(turn)) * static_cast<double>(n * n), 1, 1e-6);
}

TEST(LinearSolverLimits, RingsOfAnyLengthHaveMultigrid) {
  for (const std::array<std::int64_t, 3>& cells :
       {GridCells{125, 125, 1}, {250, 250, 1}, {300, 300, 1}, {999, 64, 1}, {25, 27, 33}, {1001, 1, 1}}) {
    for (const double shift : {0.0, 1.0}) {
      const StencilMatrix matrix = diffusion(cells, rings, shift, uneven);
      const std::vector<double> b = arbitrary_values(matrix.size(), 4);
      for (const SolverMethod method : {SolverMethod::cg, SolverMethod::multigrid}) {
        std::vector<double> x(b.size(), 0.0);
        LinearSolver solver(matrix, {.method = method, .tolerance = 1e-8});
        const SolveReport report = solver.solve(b, x);
        EXPECT_TRUE(report.converged) << cells[0] << " " << name_of(method);
        EXPECT_LE(report.iterations, method == SolverMethod::cg ? 20 : 40) << cells[0] << " x " << cells[1];
        EXPECT_NE(solver.reason().find("multigrid"), std::string::npos);
      }
    }
  }
}

TEST(LinearSolverLimits, RefusalsAreTrue) {
  const StencilMatrix pairs = diffusion({2, 64, 1}, rings, 1, uneven);
  EXPECT_NE(refusal_of(pairs, SolverMethod::multigrid).find("two ways to one neighbour"), std::string::npos);
  StencilMatrix far = diffusion({9, 9, 1}, values, 1, constant_one);
  for (const int step : {2, -2}) {
    far.offsets.push_back({step, 0, 0});
    far.values.emplace_back(81, 0.0);
    for (std::size_t i = 0; i < 81; ++i) far.values.back()[i] = step > 0 ? (i % 9 < 7) : (i % 9 > 1);
  }
  EXPECT_NE(refusal_of(far, SolverMethod::multigrid).find("others than their neighbours"), std::string::npos);
  const StencilMatrix indefinite = diffusion({8, 8, 1}, values, -35, constant_one);
  EXPECT_NE(refusal_of(indefinite, SolverMethod::multigrid).find("dominated"), std::string::npos);
}

TEST(SolverShelf, SharesSolversOfEqualMatricesWhileOneIsUsed) {
  SolverShelf shelf;
  const auto of_shift = [](double shift) {
    return std::make_shared<const GridOperator>(diffusion({9, 7, 1}, values, shift, uneven), 0x1p-52);
  };
  const auto matrix = of_shift(1), other = of_shift(2);
  auto first = shelf.solver_of(matrix, {});
  EXPECT_EQ(shelf.solver_of(of_shift(1), {}), first);
  EXPECT_NE(shelf.solver_of(other, {}), first);
  EXPECT_NE(shelf.solver_of(matrix, {.method = SolverMethod::cg}), first);
  const std::weak_ptr<LinearSolver> watched = first;
  first.reset();
  EXPECT_TRUE(watched.expired()) << "the shelf keeps none";
}

/// D*A*D has the null vector 1/D.
StencilMatrix scaled(StencilMatrix matrix, const std::vector<double>& d) {
  StencilMatrix result = matrix;
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    StencilMatrix one{matrix.cells, matrix.periodic, {matrix.offsets[k]}, {matrix.values[k]}};
    for_each_entry(one, [&](std::size_t row, std::size_t column, double value) {
      result.values[k][row] = d[row] * value * d[column];
    });
  }
  return result;
}

TEST(LinearSolverLimits, OtherNullVectorsAreNamed) {
  std::vector<double> d = arbitrary_values(20 * 15, 6);
  for (double& value : d) value = 2 + value;
  const StencilMatrix matrix = scaled(diffusion({20, 15, 1}, slopes, 0, uneven), d);
  EXPECT_NE(refusal_of(matrix, SolverMethod::automatic).find("singular"), std::string::npos);
  EXPECT_NE(refusal_of(matrix, SolverMethod::direct).find("singular"), std::string::npos);
  const std::vector<double> b = arbitrary_values(matrix.size(), 7);
  std::vector<double> x(b.size(), 0.0);
  const SolveReport report = LinearSolver(matrix, {.method = SolverMethod::cg, .most_iterations = 1000}).solve(b, x);
  EXPECT_FALSE(report.converged);
  EXPECT_TRUE(report.is_singular || report.is_indefinite);
}

/// Later solves check their own right-hand sides, although the waves are already verified.
TEST(LinearSolverLimits, LaterFourierSolvesSayWhatIsIncompatible) {
  const StencilMatrix matrix = diffusion({12, 9, 1}, rings, 0, constant_one);
  LinearSolver solver(matrix, {.method = SolverMethod::fourier});
  std::vector<double> b = arbitrary_values(matrix.size(), 3), x(b.size(), 0.0);
  double mean = 0;
  for (const double value : b) mean += value / static_cast<double>(b.size());
  for (const double added : {0.0, 0.5, 0.0, 3.0}) {
    double whole = 0;
    std::vector<double> right = b;
    for (double& value : right) value += added - mean, whole += value * value;
    const double part = added * std::sqrt(static_cast<double>(b.size()) / whole);
    EXPECT_NEAR(solver.solve(right, x).incompatible, part, 1e-12) << added;
  }
}

/// -lap(x) - lambda*x on a ring, lambda the eigenvalue of the first two waves.
TEST(LinearSolverLimits, WavesAtAnEigenvalueAreIncompatible) {
  const std::int64_t n = 32;
  const double turn = 2 * std::numbers::pi / static_cast<double>(n),
               lambda = (2 - 2 * std::cos(turn)) * static_cast<double>(n * n);
  const StencilMatrix matrix = diffusion({n, 1, 1}, rings, -lambda, constant_one);
  const std::vector<double> b = arbitrary_values(n, 3);
  std::vector<double> x(b.size(), 0.0);
  const SolveReport report = LinearSolver(matrix, {.method = SolverMethod::fourier}).solve(b, x);
  EXPECT_TRUE(report.converged) << report.residual;
  double cosine = 0, sine = 0, whole = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    cosine += b[i] * std::cos(turn * static_cast<double>(i));
    sine += b[i] * std::sin(turn * static_cast<double>(i));
    whole += b[i] * b[i];
  }
  const double part = std::sqrt((cosine * cosine + sine * sine) * 2 / static_cast<double>(n) / whole);
  EXPECT_NEAR(report.incompatible, part, 1e-12);
  EXPECT_LT(error_of(matrix, b, x), 1e-9);
  EXPECT_NE(refusal_of(matrix, SolverMethod::direct).find("singular"), std::string::npos);
}

/// Rows sum to 0 but columns do not.
StencilMatrix lopsided(const GridCells& cells) {
  StencilMatrix matrix = diffusion(cells, slopes, 0, constant_one);
  for (auto& column : matrix.values) {
    for (std::size_t i = 0; i < column.size(); ++i) column[i] *= 1 + 0.01 * static_cast<double>(i % 7);
  }
  return matrix;
}

TEST(LinearSolverLimits, LopsidedOperators) {
  const StencilMatrix matrix = lopsided({11, 9, 1});
  EXPECT_NE(refusal_of(matrix, SolverMethod::bicgstab).find("singular and not symmetric"), std::string::npos);
  std::vector<double> b = arbitrary_values(matrix.size(), 7), x(b.size(), 0.0);
  LinearSolver solver(matrix, {});
  const SolveReport report = solver.solve(b, x);
  EXPECT_TRUE(report.converged) << report.residual;
  double product = 0, whole = 0, length = 0;  // the left null vector is 1/(the factors of rows)
  for (std::size_t i = 0; i < b.size(); ++i) {
    const double y = 1 / (1 + 0.01 * static_cast<double>(i % 7));
    product += y * b[i], whole += b[i] * b[i], length += y * y;
  }
  EXPECT_NEAR(report.incompatible, std::abs(product) / std::sqrt(whole * length), 1e-12);
  EXPECT_LT(error_of(matrix, b, x), 1e-10);
  b[5] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(solver.solve(b, x).converged);
}

TEST(LinearSolverLimits, NothingIsAllocatedInASolve) {
  for (const Walls& walls : {rings, slopes, values}) {
    const StencilMatrix matrix = diffusion({75, 64, 1}, walls, 0, uneven);
    const std::vector<double> b = arbitrary_values(matrix.size(), 7);
    for (const SolverMethod method : {SolverMethod::cg, SolverMethod::multigrid}) {
      LinearSolver solver(matrix, {.method = method, .tolerance = 1e-8});
      std::vector<double> x(b.size(), 0.0);
      const long before = allocations();
      EXPECT_TRUE(solver.solve(b, x).converged);
      EXPECT_EQ(allocations(), before) << name_of(method);
    }
  }
}

/// A grid that cannot be coarsened: its factorisation takes almost no time.
TEST(LinearSolverLimits, LargeCoarsestGrids) {
  const StencilMatrix matrix =
      diffusion({3, 2500, 1}, rings, 0, [](auto, std::size_t axis) { return axis == 0 ? 1.0 : 1e-8; });
  const std::vector<double> b = arbitrary_values(matrix.size(), 7);
  std::vector<double> x(b.size(), 0.0);
  const SolveReport report = LinearSolver(matrix, {.method = SolverMethod::cg}).solve(b, x);
  EXPECT_TRUE(report.converged);
  EXPECT_LE(report.iterations, 12);
}

/// By rounding, A applied to x contains a component that A maps to 0. In a long, stiff grid, where A*x is small
/// compared with x, this component would dominate residuals and corrections.
TEST(LinearSolverLimits, WhatIsSingularAndStiffComesToItsTolerance) {
  const std::int64_t n = 300;
  for (const bool is_ring : {true, false}) {
    for (const double along : {1e-7, 1e-8, 1e-9, 1e-10}) {
      for (const bool has_rooms : {false, true}) {
        const auto k = [&](std::int64_t cell, std::size_t axis) {
          const bool is_cut = has_rooms && (cell / 3 == 99 || cell / 3 == n - 1);  // two rooms
          return axis == 0 ? 1.0 : is_cut ? 0.0 : 70 * along;
        };
        const StencilMatrix matrix = diffusion({3, n, 1}, is_ring ? rings : slopes, 0, k);
        for (const SolverMethod method : {SolverMethod::cg, SolverMethod::bicgstab, SolverMethod::gmres}) {
          for (const unsigned seed : {1u, 2u, 3u, 4u}) {
            const std::vector<double> b = arbitrary_values(matrix.size(), seed);
            std::vector<double> x(b.size(), 0.0);
            const SolveReport report = LinearSolver(matrix, {.method = method}).solve(b, x);
            EXPECT_TRUE(report.converged) << name_of(method) << " " << along << ": " << report.residual;
            EXPECT_LE(report.residual, report.bound) << name_of(method) << " " << along;
            EXPECT_LE(report.iterations, 20) << name_of(method) << " " << along << " " << has_rooms;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace dpde
