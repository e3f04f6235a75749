// SPDX-License-Identifier: Apache-2.0
// Fourier series along the periodic axes combined with elimination along the single other axis.
#include "solve/fourier/separable.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "solve/solver/linear_solver.h"
#include "solve_operators.h"

namespace dpde::test {
namespace {

constexpr std::pair<Wall, Wall> ring{Wall::periodic, Wall::periodic}, slope{Wall::slope, Wall::slope},
    value{Wall::value, Wall::value}, mixed{Wall::value, Wall::slope};

/// Varies along the line, differently for each axis.
Coefficient along(std::size_t line, const GridCells& cells) {
  return [=](std::int64_t cell, std::size_t axis) {
    std::int64_t place = cell;
    for (std::size_t before = 0; before < line; ++before) place /= cells[before];
    place %= cells[line];
    return 1 + 0.3 * static_cast<double>(axis) + 0.2 * static_cast<double>(place * place % 7);
  };
}

LinearSolver automatic(const StencilMatrix& matrix, const Team& team = 1) { return LinearSolver(matrix, {}, team); }

struct Grid {
  GridCells cells;
  std::size_t line;
};

/// The line along each axis, with the first Fourier axis innermost or outermost; few cells, odd and even.
const std::vector<Grid> grids{{{8, 5, 1}, 1}, {{5, 8, 1}, 0}, {{6, 4, 5}, 1}, {{4, 5, 3}, 2}, {{3, 4, 6}, 0},
                              {{1, 7, 4}, 1}, {{7, 1, 4}, 0}, {{2, 2, 1}, 1}, {{3, 2, 2}, 0}, {{9, 2, 1}, 1}};

TEST(Separable, HasThePseudoInverse) {
  for (const Grid& grid : grids) {
    for (const auto& wall : {slope, value, mixed}) {
      for (const double shift : {0.0, 0.7}) {
        std::array<std::pair<Wall, Wall>, 3> walls{ring, ring, ring};
        walls[grid.line] = wall;
        const StencilMatrix matrix = diffusion(grid.cells, walls, shift, along(grid.line, grid.cells));
        LinearSolver solver = automatic(matrix);
        const std::string place =
            fmt::format("{} along {}, shift {}: {}", fmt::join(grid.cells, " x "), grid.line, shift, solver.reason());
        if (grid.cells[grid.line] > 2)
          EXPECT_NE(solver.reason().find("elimination along the other axis"), std::string::npos) << place;
        for (const unsigned seed : {1U, 2U}) {  // the second solve uses series that were verified
          const std::vector<double> b = arbitrary_values(matrix.size(), seed);
          std::vector<double> x(b.size());
          const SolveReport report = solver.solve(b, x);
          EXPECT_TRUE(report.converged) << place;
          EXPECT_LT(error_of(matrix, b, x), 1e-12) << place;
        }
      }
    }
  }
}

/// The adjoint's solver, for rows that are unsymmetric along the line.
TEST(Separable, TakesRowsThatAreNotSymmetric) {
  const GridCells cells{6, 5, 1};
  StencilMatrix matrix = diffusion(cells, {ring, value, ring}, 0.4, along(1, cells));
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    for (double& entry : matrix.values[k]) entry *= matrix.offsets[k] == std::array<int, 3>{0, 1, 0} ? 0.6 : 1;
  }
  for (const StencilMatrix& one : {matrix, transposed(matrix)}) {
    LinearSolver solver = automatic(one);
    EXPECT_EQ(solver.method(), SolverMethod::fourier);
    const std::vector<double> b = arbitrary_values(one.size(), 3);
    std::vector<double> x(b.size());
    solver.solve(b, x);
    EXPECT_LT(error_of(one, b, x), 1e-12);
  }
}

/// Entries of another size at some positions, growing waves, moving waves, wider stencils, two different axes.
TEST(Separable, LeavesOtherOperators) {
  const GridCells cells{6, 5, 1};
  const StencilMatrix fits = diffusion(cells, {ring, value, ring}, 0, along(1, cells));
  const auto is_taken = [](const StencilMatrix& matrix) {
    return SeparableSolver::of(matrix, NullSpace(matrix, 0x1p-52)).has_value();
  };
  EXPECT_TRUE(is_taken(fits));
  StencilMatrix uneven = fits;
  uneven.values[0][8] *= 1 + 1e-9;
  EXPECT_FALSE(is_taken(uneven));
  EXPECT_FALSE(is_taken(diffusion(cells, {ring, value, ring}, -60, along(1, cells)))) << "no dominant diagonal";
  EXPECT_FALSE(is_taken(diffusion(cells, {value, value, ring}, 0, along(1, cells))));
  EXPECT_FALSE(is_taken(diffusion(cells, {ring, ring, ring}, 1, along(1, cells)))) << "the line is a ring";
  StencilMatrix moving = fits;
  for (std::size_t k = 0; k < moving.offsets.size(); ++k) {
    for (double& entry : moving.values[k]) entry *= moving.offsets[k] == std::array<int, 3>{1, 0, 0} ? 0.9 : 1;
  }
  EXPECT_FALSE(is_taken(moving)) << "waves have another phase then";
  StencilMatrix far = fits;
  far.offsets.push_back({0, 2, 0});
  far.values.emplace_back(30, 0.01);
  EXPECT_FALSE(is_taken(far));
  StencilMatrix rooms = diffusion(cells, {ring, slope, ring}, 0, [&](std::int64_t cell, std::size_t axis) {
    return axis == 1 && cell / 6 == 2 ? 0.0 : 1.0;
  });
  EXPECT_FALSE(is_taken(rooms)) << "two parts with a constant each";
}

TEST(Separable, HasTheBitsOfOneThread) {
  for (const auto& [cells, line] : {Grid{{180, 100, 1}, 1}, Grid{{30, 25, 24}, 1}, Grid{{25, 30, 24}, 0}}) {
    std::array<std::pair<Wall, Wall>, 3> walls{ring, ring, ring};
    walls[line] = slope;
    const StencilMatrix matrix = diffusion(cells, walls, 0, along(line, cells));
    const std::vector<double> b = arbitrary_values(matrix.size(), 5);
    std::vector<double> one(b.size()), two(b.size());
    EXPECT_TRUE(automatic(matrix).solve(b, one).converged);
    automatic(matrix, Team(2)).solve(b, two);
    EXPECT_EQ(one, two);
  }
}

}  // namespace
}  // namespace dpde::test
