// SPDX-License-Identifier: Apache-2.0
// Methods x precisions x singular or not x grids: the result of a solver is finite and no worse than its start. If b is
// in the range, the residual reaches the precision of the entries, or the method is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dpde/runtime/error.h"
#include "solve/solver/linear_solver.h"
#include "solve_operators.h"

namespace dpde::test {
namespace {

struct Case {
  bool is_single, is_singular, is_stretched;
  std::string text() const {
    return std::string(is_single ? "f32" : "f64") + (is_singular ? " singular" : " regular") +
           (is_stretched ? " stretched" : " uniform");
  }
};

/// Cells of exponential widths: fluxes over distances. Entries are rounded separately, so in single precision row sums
/// are 1e-7 of the entries, and matrix and transpose differ.
StencilMatrix operator_of(const Case& of, const GridCells& cells) {
  const auto width = [&](std::int64_t i) { return of.is_stretched ? std::exp(0.15 * static_cast<double>(i)) : 1.0; };
  const auto flux = [&](std::int64_t cell, std::size_t axis) {
    const std::int64_t x = cell % cells[0], y = cell / cells[0];
    return axis == 0 ? 2 / (width(x) + width(x + 1)) : width(x) / (1 + 0.1 * static_cast<double>(y % 2));
  };
  const Wall wall = of.is_singular ? Wall::slope : Wall::value;
  StencilMatrix matrix =
      diffusion(cells, {std::pair{Wall::slope, wall}, {wall, Wall::slope}, {Wall::periodic, Wall::periodic}}, 0, flux);
  if (!of.is_single) return matrix;
  for (std::vector<double>& column : matrix.values) {
    for (double& value : column) value = static_cast<float>(value);
  }
  return matrix;
}

double residual_of(const StencilMatrix& matrix, const std::vector<double>& b, const std::vector<double>& x) {
  std::vector<double> image(b.size());
  multiply(matrix, x, image);
  double left = 0, size = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    left += (b[i] - image[i]) * (b[i] - image[i]);
    size += b[i] * b[i];
  }
  return std::sqrt(left / size);
}

/// The residual from rounding of the entries: diagonals are changed such that rows have their exact sums.
double by_rounding(const StencilMatrix& matrix, const std::vector<double>& b, const std::vector<double>& x,
                   const SolveOptions& options) {
  double largest_row = 0, of_x = 0, of_b = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    double row = 0;
    for (const std::vector<double>& column : matrix.values) row += std::abs(column[i]);
    largest_row = std::max(largest_row, row);
    of_x += x[i] * x[i];
    of_b += b[i] * b[i];
  }
  return 8 * options.rounding * largest_row * std::sqrt(of_x / of_b);
}

TEST(SingularSolves, LeaveNothingWorseWithAnyMethod) {
  for (int bits = 0; bits < 8; ++bits) {
    const Case of{(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0};
    for (const GridCells& cells : {GridCells{3, 4, 1}, GridCells{12, 9, 1}, GridCells{24, 20, 1}}) {
      const StencilMatrix matrix = operator_of(of, cells);
      for (const SolverMethod method : {SolverMethod::automatic, SolverMethod::direct, SolverMethod::multigrid,
                                        SolverMethod::cg, SolverMethod::bicgstab, SolverMethod::gmres}) {
        SCOPED_TRACE(of.text() + " " + std::string(name_of(method)) + " " + std::to_string(cells[0]));
        SolveOptions options{.method = method, .tolerance = 1e-12};
        if (of.is_single) options.rounding = 0x1p-23;
        for (unsigned seed = 1; seed <= 3; ++seed) {
          std::vector<double> b = arbitrary_values(matrix.size(), seed), x(b.size(), 0.0);
          double mean = 0;
          for (const double value : b) mean += value / static_cast<double>(b.size());
          for (double& value : b) value -= mean;
          try {
            LinearSolver solver(matrix, options);
            const SolveReport report = solver.solve(b, x);
            EXPECT_TRUE(report.converged) << report.residual << " " << report.bound << " " << report.iterations;
            EXPECT_LE(residual_of(matrix, b, x), std::max({report.bound, 1e-9, by_rounding(matrix, b, x, options)}));
            x.assign(x.size(), 0.0);
            b.front() += 1;  // outside the range of a singular operator
            solver.solve(b, x);
            EXPECT_LE(residual_of(matrix, b, x), 1 + 1e-6);
          } catch (const Error& error) {  // multigrid and cg do not fit
            EXPECT_TRUE(method == SolverMethod::multigrid || method == SolverMethod::cg) << error.what();
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace dpde::test
