// SPDX-License-Identifier: Apache-2.0
// Fourier solvers against dense pseudo-inverses, with all pairs of sides on grids of small and odd extents.
#include "solve/fourier/fourier.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "allocations.h"
#include "solve/solver/linear_solver.h"
#include "solve_operators.h"

namespace dpde {

using namespace test;

namespace {

using Pair = std::pair<Wall, Wall>;
const std::vector<Pair> every_pair{{Wall::periodic, Wall::periodic},
                                   {Wall::value, Wall::value},
                                   {Wall::slope, Wall::slope},
                                   {Wall::value, Wall::slope},
                                   {Wall::slope, Wall::value}};

std::string name_of(const StencilMatrix& matrix, const std::array<Pair, 3>& walls) {
  std::string name;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    name += std::to_string(matrix.cells[axis]) + " ";
    for (const Wall wall : {walls[axis].first, walls[axis].second})
      name += wall == Wall::periodic ? "p" : wall == Wall::value ? "v" : "s";
    name += " ";
  }
  return name;
}

void expect_right(const StencilMatrix& matrix, const std::string& name) {
  const std::vector<double> b = arbitrary_values(matrix.size(), 3);
  std::vector<double> x(b.size(), 0.0);
  LinearSolver solver(matrix, {.method = SolverMethod::fourier});
  EXPECT_TRUE(solver.solve(b, x).converged) << name;
  EXPECT_LT(error_of(matrix, b, x), 1e-11) << name;
}

/// The mirror cells of a neighbour are within one length of the wall.
bool fits(const GridCells& cells, const std::array<Pair, 3>& walls) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (walls[axis].first != Wall::periodic && cells[axis] < 3) return false;
  }
  return true;
}

TEST(FourierSolvers, AllPairsOfSidesOnLinesAndPlanes) {
  int solved = 0;
  for (const Pair& along : every_pair) {
    for (std::int64_t n = 1; n <= 21; ++n) {
      const std::array<Pair, 3> walls{along, every_pair[0], every_pair[0]};
      for (const GridCells& cells : {GridCells{n, 1, 1}, GridCells{1, n, 1}, GridCells{1, 1, n}}) {
        std::array<Pair, 3> turned = walls;
        std::swap(turned[0], turned[static_cast<std::size_t>(std::ranges::max_element(cells) - cells.begin())]);
        if (!fits(cells, turned)) continue;
        const StencilMatrix matrix = diffusion(cells, turned, 1, constant_one);
        expect_right(matrix, name_of(matrix, turned));
        ++solved;
      }
    }
    for (const Pair& across : every_pair) {
      for (const GridCells& cells :
           {GridCells{3, 4, 1}, GridCells{4, 3, 1}, GridCells{8, 5, 1}, GridCells{5, 1, 8}, GridCells{1, 9, 11},
            GridCells{16, 7, 1}, GridCells{17, 3, 1}, GridCells{2, 9, 1}, GridCells{9, 2, 1}}) {
        const std::array<Pair, 3> walls = cells[2] == 1   ? std::array{along, across, every_pair[0]}
                                          : cells[1] == 1 ? std::array{along, every_pair[0], across}
                                                          : std::array{every_pair[0], along, across};
        if (!fits(cells, walls)) continue;
        for (const double shift : {0.0, 2.0}) {
          const StencilMatrix matrix = diffusion(cells, walls, shift, constant_one);
          expect_right(matrix, name_of(matrix, walls));
          ++solved;
        }
      }
    }
  }
  EXPECT_GT(solved, 600);
}

TEST(FourierSolvers, AllPairsOfSidesInSpace) {
  for (const Pair& x : every_pair) {
    for (const Pair& y : every_pair) {
      for (const Pair& z : every_pair) {
        for (const GridCells& cells : {GridCells{3, 5, 4}, GridCells{6, 3, 5}}) {
          const StencilMatrix matrix = diffusion(cells, {x, y, z}, 0, constant_one);
          expect_right(matrix, name_of(matrix, {x, y, z}));
        }
      }
    }
  }
}

/// Flow along the periodic axes, which gives a complex symbol, and a different coefficient along each axis.
TEST(FourierSolvers, OperatorsThatAreNotEven) {
  for (const Pair& wall : every_pair) {
    for (const GridCells& cells : {GridCells{7, 6, 5}, GridCells{4, 9, 3}}) {
      for (std::size_t bounded = 0; bounded < 3; ++bounded) {
        std::array<Pair, 3> walls{every_pair[0], every_pair[0], every_pair[0]};
        walls[bounded] = wall;
        StencilMatrix matrix = diffusion(cells, walls, 2, [](auto, std::size_t axis) { return 1.0 + axis; });
        for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
          double change = 0;
          for (std::size_t axis = 0; axis < 3; ++axis) change += axis == bounded ? 0 : 5 * matrix.offsets[k][axis];
          for (double& value : matrix.values[k]) value += change;
        }
        expect_right(matrix, name_of(matrix, walls));
      }
    }
  }
}

/// -lap(x) - lambda*x with an eigenvalue lambda: its waves are removed from the right-hand side.
TEST(FourierSolvers, WavesAtAnEigenvalueAreDropped) {
  for (const Pair& x : every_pair) {
    for (const Pair& y : every_pair) {
      const GridCells cells{9, 8, 1};
      const std::array<Pair, 3> walls{x, y, every_pair[0]};
      const std::vector<double> values = symmetric_eigenvalues(dense_of(diffusion(cells, walls, 0, constant_one)));
      const StencilMatrix matrix = diffusion(cells, walls, -values[5], constant_one);
      const std::vector<double> b = arbitrary_values(matrix.size(), 3);
      std::vector<double> solution(b.size(), 0.0);
      const SolveReport report = LinearSolver(matrix, {.method = SolverMethod::fourier}).solve(b, solution);
      EXPECT_TRUE(report.converged) << name_of(matrix, walls);
      EXPECT_GT(report.incompatible, 1e-3) << name_of(matrix, walls);
      EXPECT_LT(error_of(matrix, b, solution), 1e-9) << name_of(matrix, walls);
    }
  }
}

/// 2 + line*(a second derivative) + a first derivative along `axis`: lines are independent.
StencilMatrix lines_along(const GridCells& cells, std::size_t axis) {
  StencilMatrix matrix{.cells = cells};
  matrix.periodic[axis] = true;
  std::int64_t step = 1;
  for (std::size_t before = 0; before < axis; ++before) step *= cells[before];
  for (int offset = -2; offset <= 2; ++offset) {
    std::array<int, 3> place{};
    place[axis] = offset;
    matrix.offsets.push_back(place);
    std::vector<double>& values = matrix.values.emplace_back();
    for (std::int64_t cell = 0; cell < matrix.size(); ++cell) {
      const auto line = static_cast<double>(cell % step + cell / step / cells[axis] * step);
      values.push_back(offset == 0 ? 2 + 2 * line : std::abs(offset) == 1 ? 0.3 * offset : -line);
    }
  }
  return matrix;
}

TEST(FourierSolvers, LinesThatDifferFromOneAnother) {
  for (const auto& [cells, axis] : {std::pair<GridCells, std::size_t>{{8, 5, 1}, 0},
                                    {{7, 3, 4}, 0},
                                    {{5, 8, 1}, 1},
                                    {{1, 9, 3}, 1},
                                    {{3, 2, 7}, 2},
                                    {{2, 9, 1}, 0},
                                    {{9, 3, 1}, 1}}) {
    const StencilMatrix matrix = lines_along(cells, axis);
    expect_right(matrix, name_of(matrix, {every_pair[0], every_pair[0], every_pair[0]}));
    EXPECT_EQ(LinearSolver(matrix, {}).method(), SolverMethod::fourier);
    StencilMatrix uneven = matrix;
    uneven.values[2][1] *= 2;
    EXPECT_NE(LinearSolver(uneven, {}).method(), SolverMethod::fourier);
  }
  EXPECT_NE(LinearSolver(lines_along({3, 8, 2}, 1), {}).method(), SolverMethod::fourier);  // lines with two distances
}

TEST(FourierSolvers, LongLinesAreAsExactAsShortOnes) {
  for (const Pair& along : every_pair) {
    for (const std::int64_t n : {1000, 1001, 1024, 997}) {
      const StencilMatrix matrix = diffusion({n, 3, 1}, {along, every_pair[0], every_pair[0]}, 1, constant_one);
      const std::vector<double> exact = arbitrary_values(matrix.size(), 3);
      std::vector<double> b(exact.size()), x(exact.size());
      multiply(matrix, exact, b);
      LinearSolver(matrix, {.method = SolverMethod::fourier}).solve(b, x);
      for (std::size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(x[i], exact[i], 1e-9) << n << " " << i;
    }
  }
}

TEST(FourierSolvers, NothingIsAllocatedInASolve) {
  for (const Pair& x : every_pair) {
    for (const Pair& y : every_pair) {
      const StencilMatrix matrix = diffusion({15, 9, 4}, {x, y, every_pair[0]}, 1, constant_one);
      const std::vector<double> b = arbitrary_values(matrix.size(), 7);
      LinearSolver solver(matrix, {.method = SolverMethod::fourier});
      std::vector<double> first(b.size()), again(b.size());
      const long before = allocations();
      solver.solve(b, first);
      solver.solve(b, again);
      EXPECT_EQ(allocations(), before);
      EXPECT_EQ(first, again);
    }
  }
}

}  // namespace
}  // namespace dpde
