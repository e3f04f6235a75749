// SPDX-License-Identifier: Apache-2.0
// Multigrid in half rows against its matrix, on grids with several levels.
#include "solve/multigrid/multigrid.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "solve/solver/linear_solver.h"
#include "solve_operators.h"

namespace dpde {

using namespace test;

namespace {

using Walls = std::array<std::pair<Wall, Wall>, 3>;

std::optional<Multigrid> multigrid_of(const StencilMatrix& matrix, bool is_symmetric,
                                      SmootherKind smoother = SmootherKind::red_black) {
  std::string why;
  const MultigridOptions options{.is_symmetric = is_symmetric, .smoother = smoother};
  return Multigrid::of(matrix, NullSpace(matrix, 0x1p-52), options, why);
}

Numbers packed(const Multigrid& multigrid, const std::vector<double>& values) {
  Numbers result(multigrid.size());
  multigrid.pack(values, result);
  return result;
}

/// The same with a disc removed: its cells are 0 and isolated.
StencilMatrix with_cylinder(StencilMatrix matrix) {
  const std::int64_t n = matrix.cells[0];
  const auto is_solid = [&](std::int64_t cell) {
    const double x = (static_cast<double>(cell % n) + 0.5) / static_cast<double>(n) - 0.4,
                 y = (static_cast<double>(cell / n) + 0.5) / static_cast<double>(n) - 0.45;
    return x * x + y * y < 0.2 * 0.2;
  };
  const StencilMatrix whole = matrix;
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    for (std::int64_t cell = 0; cell < matrix.size(); ++cell) {
      const auto c = static_cast<std::size_t>(cell);
      const std::int64_t other = column_of(matrix, {cell % n, cell / n, 0}, matrix.offsets[k]);
      if (is_solid(cell)) {
        matrix.values[k][c] = 0;
      } else if (k > 0 && other >= 0 && is_solid(other)) {
        matrix.values[k][c] = 0;
        matrix.values[0][c] += whole.values[k][c];
      }
    }
  }
  return matrix;
}

template <class F>
void for_each_wall(const F& f) {
  for (const auto& x : all_walls) {
    for (const auto& y : all_walls) f(Walls{x, y, all_walls[0]}), f(Walls{x, y, all_walls[2]});
  }
}

TEST(Multigrid, MultipliesAsItsMatrixOnEverySmallExtent) {
  int checked = 0;
  for_each_wall([&](const Walls& walls) {
    for (std::int64_t nx = 1; nx <= 9; ++nx) {
      for (const auto& [ny, nz] : {std::pair<int, int>{1, 1}, {1, 3}, {3, 1}, {4, 1}, {3, 3}, {5, 4}}) {
        const StencilMatrix matrix = diffusion({nx, ny, nz}, walls, 0.5, uneven);
        const std::optional<Multigrid> multigrid = multigrid_of(matrix, false);
        if (!multigrid) continue;  // rings of two cells
        const std::vector<double> x = arbitrary_values(matrix.size(), 5);
        std::vector<double> expected(x.size()), b(x.size());
        multiply(matrix, x, expected);
        Numbers y(multigrid->size());
        multigrid->multiply(packed(*multigrid, x), y);
        multigrid->unpack(y, b);
        for (std::size_t i = 0; i < b.size(); ++i)
          ASSERT_NEAR(b[i], expected[i], 1e-12) << nx << " " << ny << " " << nz;
        ++checked;
      }
    }
  });
  EXPECT_GT(checked, 500);
}

std::vector<double> of_cycle(Multigrid& multigrid, const std::vector<double>& right) {
  Numbers packed_right(multigrid.size()), x(multigrid.size());
  multigrid.pack_right(right, packed_right);
  multigrid.cycle(packed_right, x);
  std::vector<double> result(right.size());
  multigrid.unpack(x, result);
  return result;
}

constexpr std::array all_smoothers{SmootherKind::red_black, SmootherKind::jacobi, SmootherKind::chebyshev};

/// <c, M*b> = <b, M*c>
void expect_symmetric_cycle(Multigrid& multigrid, const std::vector<double>& b, const std::vector<double>& c,
                            const std::string& what) {
  const std::vector<double> of_b = of_cycle(multigrid, b), of_c = of_cycle(multigrid, c);
  const double forth = std::inner_product(c.begin(), c.end(), of_b.begin(), 0.0);
  const double back = std::inner_product(b.begin(), b.end(), of_c.begin(), 0.0);
  EXPECT_NEAR(forth, back, 1e-12 * std::abs(forth) + 1e-13) << what;
}

/// Preconditioner of conjugate gradients, also around odd rings.
TEST(Multigrid, SymmetricCyclesAreSymmetric) {
  int checked = 0;
  for_each_wall([&](const Walls& walls) {
    for (const GridCells& cells :
         {GridCells{12, 16, 1}, {13, 11, 1}, {70, 1, 1}, {71, 1, 1}, {1, 75, 1}, {9, 8, 6}, {8, 7, 5}}) {
      const StencilMatrix matrix = diffusion(cells, walls, 0.1, uneven);
      for (const SmootherKind smoother : all_smoothers) {
        std::optional<Multigrid> multigrid = multigrid_of(matrix, true, smoother);
        if (!multigrid) continue;
        ASSERT_GT(multigrid->levels(), 1);
        const std::vector<double> b = arbitrary_values(matrix.size(), 6), c = arbitrary_values(matrix.size(), 7);
        expect_symmetric_cycle(*multigrid, b, c, fmt::format("{} {} {}", cells[0], cells[1], cells[2]));
        ++checked;
      }
    }
  });
  EXPECT_GT(checked, 450);
}

/// Coarse cells that an obstacle covers next to fine cells that it does not cover: no coupling passes through them,
/// also if a single axis is coarsened.
TEST(Multigrid, SymmetricCyclesAreSymmetricAroundObstacles) {
  for (const double stronger_along_y : {1.0, 16.0, 1.0 / 16}) {
    const auto k = [&](std::int64_t, std::size_t axis) { return axis == 1 ? stronger_along_y : 1; };
    for (const std::int64_t n : {44, 48, 64, 101, 128, 200}) {
      for (const auto& wall : all_walls) {
        const StencilMatrix matrix = with_cylinder(diffusion({n, n, 1}, {wall, all_walls[2], all_walls[0]}, 0, k));
        std::vector<double> b = arbitrary_values(matrix.size(), 6), c = arbitrary_values(matrix.size(), 7);
        const NullSpace null_space(matrix, 0x1p-52);
        null_space.remove(b);
        null_space.remove(c);
        for (const SmootherKind smoother : all_smoothers) {
          std::optional<Multigrid> multigrid = multigrid_of(matrix, true, smoother);
          ASSERT_TRUE(multigrid);
          expect_symmetric_cycle(*multigrid, b, c, fmt::format("{} {}", n, stronger_along_y));
        }
      }
    }
  }
}

void expect_near_solution(const StencilMatrix& matrix, Multigrid& multigrid, const std::string& what) {
  const std::vector<double> b = arbitrary_values(matrix.size(), 8);
  std::vector<double> x(b.size()), image(b.size());
  Numbers right(multigrid.size()), solution(multigrid.size());
  multigrid.pack_right(b, right);
  const IterationReport report = multigrid.iterate(right, solution, 1e-10, 0, 40);
  EXPECT_TRUE(report.converged) << what << ": " << report.residual;
  multigrid.unpack(solution, x);
  multiply(matrix, x, image);
  double left = 0, whole = 0;
  for (std::size_t i = 0; i < b.size(); ++i) left += std::pow(b[i] - image[i], 2), whole += b[i] * b[i];
  EXPECT_LT(std::sqrt(left / whole), 2e-10) << what;
}

/// Each cycle at least halves the residual, computed by the matrix itself.
TEST(Multigrid, CyclesComeNearerOnOddAndEvenGrids) {
  for_each_wall([&](const Walls& walls) {
    for (const GridCells& cells : {GridCells{16, 24, 1}, {13, 11, 1}, {128, 1, 1}, {71, 1, 1}, {9, 8, 6}, {8, 7, 5}}) {
      const StencilMatrix matrix = diffusion(cells, walls, 0.1, constant_one);
      for (const SmootherKind smoother : all_smoothers) {
        std::optional<Multigrid> multigrid = multigrid_of(matrix, false, smoother);
        const auto of = static_cast<int>(smoother);
        if (multigrid)
          expect_near_solution(matrix, *multigrid, fmt::format("{} {} {} by {}", cells[0], cells[1], cells[2], of));
      }
    }
  });
}

/// Several cycles in one call traverse the finest level in one pass; the result equals that of separate calls.
TEST(Multigrid, CyclesInOneCallAreThoseOfSeveral) {
  for_each_wall([&](const Walls& walls) {
    for (const GridCells& cells :
         {GridCells{16, 24, 1}, {13, 11, 1}, {4, 4, 1}, {6, 3, 1}, {128, 1, 1}, {9, 8, 6}, {8, 6, 4}, {2, 4, 8}}) {
      const StencilMatrix matrix = diffusion(cells, walls, 0.1, constant_one);
      for (const SmootherKind smoother : all_smoothers) {
        std::optional<Multigrid> multigrid = multigrid_of(matrix, false, smoother);
        if (!multigrid) continue;
        Numbers b(multigrid->size()), at_once(b.size()), one_by_one(b.size());
        multigrid->pack_right(arbitrary_values(matrix.size(), 3), b);
        const IterationReport report = multigrid->iterate(b, at_once, 0, 0, 4);
        IterationReport last;
        for (int cycle = 0; cycle < 4; ++cycle) last = multigrid->iterate(b, one_by_one, 0, 0, 1);
        EXPECT_NEAR(report.residual, last.residual, 1e-13) << cells[0] << " " << cells[1] << " " << cells[2];
        double apart = 0, most = 0;
        for (std::size_t i = 0; i < b.size(); ++i) {
          apart = std::max(apart, std::abs(at_once[i] - one_by_one[i]));
          most = std::max(most, std::abs(one_by_one[i]));
        }
        EXPECT_LE(apart, 1e-14 * most) << cells[0] << " " << cells[1] << " " << cells[2];
      }
    }
  });
}

/// The eigenvalue of a wave after two steps is the product of 1 - factor*lambda. For waves that the next level cannot
/// represent it is at most the textbook value, 0.36 and 0.22 on two axes, 0.51 and 0.34 on three.
TEST(Smoothers, DampWavesOfTheFineGridAlone) {
  const auto largest = [](SmootherKind smoother, double share) {
    const auto [first, second] = factors_of(smoother, share);
    double found = 0;
    for (int i = 0; i <= 1000; ++i) {
      const double lambda = share + (2 - share) * i / 1000;
      found = std::max(found, std::abs((1 - first * lambda) * (1 - second * lambda)));
    }
    return found;
  };
  EXPECT_NEAR(largest(SmootherKind::jacobi, 0.5), 0.36, 1e-12);
  EXPECT_NEAR(largest(SmootherKind::jacobi, 1 / 3.0), 25 / 49.0, 1e-12);
  const auto of_chebyshev = [](double share) {  // 1/T_2
    const double x = (2 + share) / (2 - share);
    return 1 / (2 * x * x - 1);
  };
  for (const double share : {1.0, 0.5, 1 / 3.0, 0.1})
    EXPECT_NEAR(largest(SmootherKind::chebyshev, share), of_chebyshev(share), 1e-12);
}

/// Coloured relaxation for equal couplings along the axes, a polynomial otherwise.
TEST(Smoothers, AreChosenByTheCouplings) {
  const auto chosen = [](double along_y) {
    const auto k = [&](std::int64_t, std::size_t axis) { return axis == 1 ? along_y : 1; };
    return multigrid_of(diffusion({64, 64, 1}, {all_walls[0], all_walls[1], all_walls[0]}, 0, k), true,
                        SmootherKind::automatic)
        ->smoother();
  };
  for (const double even : {1.0, 1.9, 0.6}) EXPECT_EQ(chosen(even), SmootherKind::red_black) << even;
  for (const double uneven_one : {2.1, 0.4, 100.0})
    EXPECT_EQ(chosen(uneven_one), SmootherKind::chebyshev) << uneven_one;
}

/// A cylinder of whole cells without equations: as many cycles as without it, on each grid.
TEST(Multigrid, GoesAroundObstacles) {
  for (const std::int64_t n : {32, 64, 128}) {
    for (const auto& wall : all_walls) {
      const StencilMatrix matrix =
          with_cylinder(diffusion({n, n, 1}, {wall, all_walls[2], all_walls[0]}, 0, constant_one));
      std::vector<double> b = arbitrary_values(matrix.size(), 9);
      for (std::size_t i = 0; i < b.size(); ++i) b[i] *= matrix.values[0][i] != 0;
      for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::cg}) {
        std::vector<double> x(b.size(), 0.0);
        const SolveReport report = LinearSolver(matrix, {.method = method, .tolerance = 1e-6}).solve(b, x);
        EXPECT_TRUE(report.converged);
        EXPECT_LE(report.iterations, 9) << n << " " << name_of(method);
      }
    }
  }
}

template <class Real>
std::vector<Real> arbitrary_numbers(std::int64_t count, unsigned seed) {
  const std::vector<double> values = arbitrary_values(count, seed);
  return {values.begin(), values.end()};
}

/// A level of 75 x 3 x 3 cells whose coefficients share the same rows; vectors are longer than needed.
template <class Real>
struct ManyRows {
  explicit ManyRows(bool is_even) {
    for (unsigned seed = 0; seed < 5; ++seed) rows.push_back(arbitrary_numbers<Real>(stride, seed));
    for (std::size_t k = 0; k < 5; ++k) row_of[k].assign(9, rows[k].data() + 8);
    level = {.cells = {75, 3, 3}, .is_ring = {false, true, false}, .odd = 48, .stride = 48, .black = 440};
    for (std::size_t axis = 0; axis < 3; ++axis) level.coupling[axis] = row_of[axis].data(), level.even[axis] = 0.3F;
    level.own = row_of[3].data();
    level.inverse = row_of[4].data();
    level.is_even = is_even;
  }
  static constexpr std::int64_t stride = 112;
  std::vector<std::vector<Real>> rows;
  std::array<std::vector<const Real*>, 5> row_of;
  LevelRows<Real> level;
};

template <class Real>
std::vector<double> results_of(const RowKernelsOf<Real>& kernels) {
  constexpr std::int64_t count = 37, size = 10 * ManyRows<Real>::stride;
  std::vector<std::vector<Real>> rows;
  for (unsigned seed = 0; seed < 13; ++seed) rows.push_back(arbitrary_numbers<Real>(size, seed + 9));
  const Real *b = rows[0].data() + 8, *x = rows[1].data() + 8, factor = 0.7F;
  RowSum<Real> sum{.count = count, .terms = 13};
  for (std::size_t k = 0; k < 13; ++k) sum.values[k] = rows[k].data(), sum.weights[k] = Real(k + 1) / 8;
  const ManyRows<Real> even(true), uneven_rows(false);
  std::vector<double> results;
  const auto keep = [&](const auto& f) {
    std::vector<Real> values(rows[2]);
    f(values.data() + 8);
    results.insert(results.end(), values.begin(), values.end());
  };
  for (const LevelRows<Real>* level : {&even.level, &uneven_rows.level}) {
    for (const RowPlace& row : {RowPlace{0, 0, 0}, RowPlace{4, 1, 1}, RowPlace{8, 2, 2}}) {
      for (const int half : {0, 1}) {
        for (std::size_t rank = 0; rank < 3; ++rank) {
          keep([&](Real* to) { kernels.smooth[rank](*level, row, half, b, to); });
          keep([&](Real* to) { results.push_back(kernels.smooth_counted[rank](*level, row, half, b, to)); });
          keep([&](Real* to) { kernels.relax[rank](*level, row, half, factor, b, x, to); });
          keep([&](Real* to) { kernels.residual[rank](*level, row, half, b, x, to); });
          keep([&](Real* to) { kernels.multiply[rank](*level, row, half, x, to); });
          results.push_back(kernels.squared_residual[rank](*level, row, half, b, x));
        }
        keep([&](Real* to) { kernels.scale(*level, row, half, factor, b, to); });
      }
    }
  }
  keep([&](Real* to) { kernels.interleave(count, b, x, to); });
  keep([&](Real* to) { kernels.sum(sum, to); });
  const InterpolatedRow<Real> row{.count = count,
                                  .near = rows[1].data(),
                                  .far = rows[2].data(),
                                  .share = rows[3].data(),
                                  .rows = {rows[4].data() + 1, rows[5].data() + 1},
                                  .weights = {factor, factor / 2},
                                  .to_far = -1};
  keep([&](Real* to) { kernels.add_interpolated(row, to); });
  keep([&](Real* to) { kernels.take_share(count, rows[6].data(), to); });
  const RestrictedRow<Real> restricted{count, b, x, {rows[7].data(), rows[8].data(), rows[9].data(), rows[10].data()}};
  keep([&](Real* to) { kernels.restrict_along(restricted, to); });
  for (const std::int64_t cells : {1, 2, 74, 75}) {
    const std::vector<double> values = arbitrary_values(75, 3);
    keep([&](Real* to) { kernels.split(cells, values.data(), 0.7, to, to + 100); });
    for (const bool is_added : {false, true}) {
      std::vector<double> joined = values;
      kernels.join(cells, b, x, 0.7, is_added, joined.data());
      results.insert(results.end(), joined.begin(), joined.end());
    }
  }
  return results;
}

std::vector<double> products_of(const RowKernels& kernels) {
  std::vector<std::vector<double>> rows;
  for (unsigned seed = 0; seed < 2 * RowProducts::most; ++seed) rows.push_back(arbitrary_values(75, seed));
  std::vector<double> results;
  for (const int terms : {1, 7, RowProducts::most}) {
    for (const bool is_added : {false, true}) {
      RowProducts products{.count = 75, .terms = terms, .is_added = is_added, .values = {}, .x = {}};
      for (std::size_t k = 0; k < RowProducts::most; ++k)
        products.values[k] = rows[k].data(), products.x[k] = rows[k + RowProducts::most].data();
      std::vector<double> made(75, 0.25);
      kernels.add_products(products, made.data());
      results.insert(results.end(), made.begin(), made.end());
    }
  }
  return results;
}

void expect_near(const std::vector<double>& portable, const std::vector<double>& chosen, double tolerance) {
  ASSERT_EQ(portable.size(), chosen.size());
  for (std::size_t i = 0; i < portable.size(); ++i)
    EXPECT_NEAR(portable[i], chosen[i], tolerance * (1 + std::abs(chosen[i]))) << i;
}

template <class Real>
void expect_same_kernels(double tolerance) {
  expect_near(results_of(row_kernels_portable().of<Real>()), results_of(row_kernels().of<Real>()), tolerance);
}

TEST(RowKernels, OfAllInstructionSetsAgree) {
  expect_same_kernels<double>(1e-13);
  expect_same_kernels<float>(2e-6);
  expect_near(products_of(row_kernels_portable()), products_of(row_kernels()), 1e-13);
}

}  // namespace
}  // namespace dpde
