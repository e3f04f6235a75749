// SPDX-License-Identifier: Apache-2.0
// Detection of the rows of operators, equal in all cells, stencils or boxes; and their use by solvers.
#include "solve/operator/grid_operator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "dpde/runtime/error.h"
#include "solve/multigrid/multigrid.h"
#include "solve/operator/operator_probe.h"
#include "solve/solver/linear_solver.h"
#include "solve_operators.h"

namespace dpde::test {
namespace {

using Walls = std::array<std::pair<Wall, Wall>, 3>;

LinearImage image_of(const StencilMatrix& matrix) {
  return [&matrix](std::span<const double> x, std::span<double> y) { multiply(matrix, x, y); };
}

/// The square of a 5- or 7-point matrix has stencil radius 2; next to walls mirror cells determine it.
LinearImage square_of(const StencilMatrix& matrix) {
  return [&matrix](std::span<const double> x, std::span<double> y) {
    std::vector<double> once(x.size());
    multiply(matrix, x, once);
    multiply(matrix, once, y);
  };
}

OperatorProbe probe_of(const StencilMatrix& matrix, std::int64_t reach) {
  std::array<std::int64_t, 3> reaches{};
  for (std::size_t axis = 0; axis < 3; ++axis) reaches[axis] = matrix.cells[axis] == 1 ? 0 : reach;
  return {matrix.cells, matrix.periodic, reaches, 0x1p-52, "p"};
}

void expect_same_products(const GridOperator& found, const LinearImage& image, const std::string& what) {
  const std::vector<double> x = arbitrary_values(found.size(), 5);
  std::vector<double> expected(x.size()), made(x.size());
  image(x, expected);
  found.multiply(x, made);
  double size = 0;
  for (const double value : expected) size = std::max(size, std::abs(value));
  for (std::size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(made[i], expected[i], 1e-12 * size) << what;
}

std::vector<Walls> walls_of(int axes) {
  std::vector<std::pair<Wall, Wall>> pairs = all_walls;
  pairs.emplace_back(Wall::slope, Wall::value);
  std::vector<Walls> all;
  for (const auto& x : pairs) {
    for (const auto& y : pairs) all.push_back({x, y, axes == 3 ? x : pairs[0]});
  }
  return all;
}

std::string name_of_walls(const Walls& walls) {
  std::string name;
  for (const auto& [low, high] : walls) name += std::to_string(int(low)) + std::to_string(int(high)) + " ";
  return name;
}

TEST(GridOperators, RowsThatAreAlikeAreFoundWithoutAMatrix) {
  for (const GridCells& cells : {GridCells{17, 12, 1}, GridCells{11, 10, 13}}) {
    for (const Walls& walls : walls_of(cells[2] > 1 ? 3 : 2)) {
      const StencilMatrix matrix = diffusion(cells, walls, 0.5, constant_one);
      for (const std::int64_t reach : {1, 2}) {
        const LinearImage image = reach == 1 ? image_of(matrix) : square_of(matrix);
        OperatorProbe probe = probe_of(matrix, reach);
        const GridOperator found = probe.find(image);
        EXPECT_LE(probe.images(), 6);
        ASSERT_NE(found.constant_rows(), nullptr) << name_of_walls(walls) << reach;
        expect_same_products(found, image, name_of_walls(walls));
      }
    }
  }
}

/// One row with one slightly different entry, at any position.
TEST(GridOperators, OneOtherRowIsSeen) {
  const Walls walls{all_walls[0], all_walls[3], all_walls[0]};
  const StencilMatrix alike = diffusion({12, 11, 1}, walls, 1, constant_one);
  for (std::size_t row = 0; row < 12 * 11; row += 7) {
    for (std::size_t k = 0; k < alike.offsets.size(); ++k) {
      StencilMatrix matrix = alike;
      if (column_of(matrix, {static_cast<std::int64_t>(row % 12), static_cast<std::int64_t>(row / 12), 0},
                    matrix.offsets[k]) < 0)
        continue;
      matrix.values[k][row] += 1e-9;
      const GridOperator found = probe_of(matrix, 1).find(image_of(matrix));
      EXPECT_EQ(found.constant_rows(), nullptr) << row << " " << k;
      expect_same_products(found, image_of(matrix), "one other");
    }
  }
}

TEST(GridOperators, WhatIsNotLinearIsSaidAsBefore) {
  const StencilMatrix matrix = diffusion({12, 11, 1}, {all_walls[0], all_walls[3], all_walls[0]}, 1, constant_one);
  const auto refusal = [&](const LinearImage& image) {
    try {
      probe_of(matrix, 1).find(image);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refusal([&](std::span<const double> x, std::span<double> y) {
              multiply(matrix, x, y);
              for (double& value : y) value += 1e-9 * value * value;
            }).find("not linear"),
            std::string::npos);
  EXPECT_NE(refusal([&](std::span<const double> x, std::span<double> y) {
              multiply(matrix, x, y);
              y[77] += 1e-3;
            }).find("makes 0.001 of 0"),
            std::string::npos);
  EXPECT_NE(refusal([&](std::span<const double> x, std::span<double> y) {
              multiply(matrix, x, y);
              y[77] = std::nan("");
            }).find("not finite"),
            std::string::npos);
}

/// A star with different coefficients in each cell: rings with a length indivisible by any number of colours, and
/// others.
TEST(GridOperators, StarsTakeFewImages) {
  struct Case {
    GridCells cells;
    Walls walls;
    int reach, most;
  };
  const Walls rings{all_walls[0], all_walls[0], all_walls[0]}, boxes{all_walls[1], all_walls[2], all_walls[3]},
      mixed{all_walls[0], all_walls[1], all_walls[0]};
  for (const Case& one :
       {Case{{16, 16, 16}, rings, 1, 20}, Case{{14, 21, 7}, rings, 1, 20}, Case{{13, 11, 17}, rings, 1, 110},
        Case{{9, 10, 11}, boxes, 1, 20}, Case{{10, 9, 9}, boxes, 2, 30}, Case{{29, 27, 1}, mixed, 6, 220},
        Case{{20, 21, 22}, boxes, 5, 60}}) {
    StencilMatrix matrix{one.cells, {}, {{0, 0, 0}}, {}};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      matrix.periodic[axis] = one.walls[axis].first == Wall::periodic;
      for (int step = -one.reach; one.cells[axis] > 1 && step <= one.reach; ++step) {
        std::array<int, 3> offset{};
        offset[axis] = step;
        if (step != 0) matrix.offsets.push_back(offset);
      }
    }
    for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
      matrix.values.push_back(arbitrary_values(matrix.size(), static_cast<unsigned>(k)));
      for_each_cell(matrix.cells, [&](std::size_t number, const GridPlace& cell) {
        if (column_of(matrix, cell, matrix.offsets[k]) < 0) matrix.values[k][number] = 0;
      });
    }
    OperatorProbe probe = probe_of(matrix, one.reach);
    const GridOperator found = probe.find(image_of(matrix));
    EXPECT_EQ(found.constant_rows(), nullptr);
    EXPECT_LE(probe.images(), one.most) << one.cells[0] << " " << one.reach;
    expect_same_products(found, image_of(matrix), "star");
    const StencilMatrix again = probe.matrix(image_of(matrix));
    EXPECT_LE(probe.images(), one.most);
  }
}

/// A stencil that is wider at one position than at the sampled ones.
TEST(GridOperators, PatternsThatMissAnEntryAreGivenUp) {
  StencilMatrix matrix = diffusion({9, 10, 11}, {all_walls[1], all_walls[2], all_walls[3]}, 1, uneven);
  matrix.offsets.push_back({1, 1, 1});
  matrix.values.emplace_back(static_cast<std::size_t>(matrix.size()), 0.0);
  matrix.values.back()[number_of(matrix.cells, {4, 5, 5})] = 1e-3;
  expect_same_products(probe_of(matrix, 1).find(image_of(matrix)), image_of(matrix), "diagonal");
}

/// For f32: an entry of 4e-6 relative to the neighbours' is advection.
TEST(GridOperators, WeakAdvectionIsNoRoundingOfASymmetricOperator) {
  const Walls rings{all_walls[0], all_walls[0], all_walls[0]};
  for (const double advection : {0.0, 4e-6}) {
    StencilMatrix matrix = diffusion({17, 12, 1}, rings, 0.5, constant_one);
    for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
      for (double& value : matrix.values[k]) value *= 1 + advection * matrix.offsets[k][0];
    }
    const GridOperator rows(matrix, 0x1p-23), alike = probe_of(matrix, 1).find(image_of(matrix));
    ASSERT_NE(alike.constant_rows(), nullptr);
    EXPECT_EQ(rows.is_symmetric(0x1p-23), advection == 0);
    EXPECT_EQ(alike.is_symmetric(0x1p-23), advection == 0);
    std::string why;
    EXPECT_EQ(Multigrid::of(matrix, rows.null_space(), {.rounding = 0x1p-23}, why).has_value(), advection == 0);
  }
}

/// A k that the diagonals contain with few digits or none, for operators computed in floats from differences.
TEST(GridOperators, SumsOfRowsAreThoseOfWhatTheOperatorMakesOfOnes) {
  const double stiff = 0x1p20;
  for (const double k : {0.0, 1e-3, 0.3, 1.5, 100.0}) {
    for (const bool is_alike : {true, false}) {
      const std::int64_t n = 96;
      const LinearImage image = [&](std::span<const double> x, std::span<double> y) {
        for (std::int64_t i = 0; i < n; ++i) {
          const auto at = [&](std::int64_t j) { return static_cast<float>(x[static_cast<std::size_t>((j + n) % n)]); };
          const auto c = [&](std::int64_t j) {
            return static_cast<float>(stiff * (is_alike ? 1 : 1.25 + 0.2 * std::sin(static_cast<double>((j + n) % n))));
          };
          y[static_cast<std::size_t>(i)] =
              c(i) * (at(i) - at(i + 1)) + c(i - 1) * (at(i) - at(i - 1)) + static_cast<float>(k) * at(i);
        }
      };
      const GridOperator found = OperatorProbe({n, 1, 1}, {true, false, false}, {1, 0, 0}, 0x1p-23, "p").find(image);
      EXPECT_EQ(found.constant_rows() != nullptr, is_alike);
      EXPECT_EQ(found.null_space().is_empty(), k != 0) << k;
      EXPECT_FALSE(found.null_space().is_lopsided());
      std::vector<double> ones(static_cast<std::size_t>(n), 1.0), sums(ones.size());
      found.multiply(ones, sums);
      for (const double sum : sums) ASSERT_NEAR(sum, k, 1e-7 * k + 1e-8) << k;
    }
  }
}

/// For a constant row, its properties equal those of its matrix.
TEST(GridOperators, ConstantRowsAreTheirMatrix) {
  for (const Walls& walls : walls_of(2)) {
    for (const double shift : {0.0, 1.0}) {
      const StencilMatrix given = diffusion({14, 11, 1}, walls, shift, constant_one);
      for (const std::int64_t reach : {1, 2}) {
        const LinearImage image = reach == 1 ? image_of(given) : square_of(given);
        const GridOperator alike = probe_of(given, reach).find(image);
        const GridOperator rows(probe_of(given, reach).matrix(image), 0x1p-52);
        ASSERT_NE(alike.constant_rows(), nullptr);
        EXPECT_EQ(alike.null_space().parts(), rows.null_space().parts()) << name_of_walls(walls) << shift;
        EXPECT_EQ(alike.null_space().is_lopsided(), rows.null_space().is_lopsided());
        EXPECT_NEAR(alike.largest_row(), rows.largest_row(), 1e-12 * rows.largest_row()) << name_of_walls(walls);
        EXPECT_TRUE(alike.is_symmetric(0x1p-52));
        EXPECT_TRUE(rows.is_symmetric(0x1p-52));
        const std::vector<double> x = arbitrary_values(given.size(), 2), of_alike = alike.diagonal(),
                                  of_rows = rows.diagonal();
        std::vector<double> y(x.size()), z(x.size());
        alike.multiply_transposed(x, y);
        rows.multiply_transposed(x, z);
        for (std::size_t i = 0; i < x.size(); ++i) {
          ASSERT_NEAR(y[i], z[i], 1e-13 * rows.largest_row());
          ASSERT_NEAR(of_alike[i], of_rows[i], 1e-13 * rows.largest_row());
        }
      }
    }
  }
}

TEST(GridOperators, SolversOfConstantRowsAreThoseOfTheMatrix) {
  for (const Walls& walls : walls_of(2)) {
    for (const double shift : {0.0, 1.0}) {
      const StencilMatrix matrix = diffusion({14, 11, 1}, walls, shift, constant_one);
      const auto alike = std::make_shared<const GridOperator>(probe_of(matrix, 1).find(image_of(matrix)));
      for (const SolverMethod method :
           {SolverMethod::automatic, SolverMethod::fourier, SolverMethod::cg, SolverMethod::multigrid,
            SolverMethod::bicgstab, SolverMethod::gmres, SolverMethod::direct}) {
        const SolveOptions options{.method = method, .tolerance = 1e-11};
        LinearSolver of_rows(alike, options), of_matrix(matrix, options);
        EXPECT_EQ(of_rows.method(), of_matrix.method());
        EXPECT_EQ(of_rows.reason(), of_matrix.reason());
        const std::vector<double> b = arbitrary_values(matrix.size(), 9);
        std::vector<double> x(b.size(), 0.0), y(b.size(), 0.0);
        const SolveReport report = of_rows.solve(b, x), expected = of_matrix.solve(b, y);
        EXPECT_TRUE(report.converged) << name_of(method) << " " << name_of_walls(walls);
        EXPECT_NEAR(report.iterations, expected.iterations, 1) << name_of(method);
        EXPECT_NEAR(report.incompatible, expected.incompatible, 1e-12) << name_of(method);
        for (std::size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(x[i], y[i], 1e-8) << name_of(method);
      }
    }
  }
}

}  // namespace
}  // namespace dpde::test
