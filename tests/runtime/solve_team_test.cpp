// SPDX-License-Identifier: Apache-2.0
// Solves by several threads are bit-identical to one thread: each method on grids of one to three axes, with rings and
// walls.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "allocations.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/layout.h"
#include "solve/multigrid/multigrid.h"
#include "solve/operator/finite.h"
#include "solve/operator/krylov.h"
#include "solve/solver/linear_solver.h"
#include "solve/solver/solve_inputs.h"
#include "solve_operators.h"
#include "support/setting.h"

namespace dpde {

using namespace test;

namespace {

constexpr auto ring = std::pair(Wall::periodic, Wall::periodic), value = std::pair(Wall::value, Wall::value),
               slope = std::pair(Wall::slope, Wall::slope), mixed = std::pair(Wall::value, Wall::slope);

struct SharedCase {
  GridCells cells;
  std::array<std::pair<Wall, Wall>, 3> walls;
  Coefficient k;
  double shift;
};

/// More cells than one thread processes alone. Around odd rings two neighbours have the same colour, and 5 planes are
/// fewer than the minimum of a slab.
std::vector<SharedCase> large_cases() {
  const std::vector<SharedCase> all{
      {{40000, 1, 1}, {ring, ring, ring}, uneven, 1},       {{200, 176, 1}, {value, slope, ring}, uneven, 0.5},
      {{200, 176, 1}, {ring, ring, ring}, constant_one, 0}, {{183, 181, 1}, {mixed, slope, ring}, constant_one, 0},
      {{183, 181, 1}, {ring, ring, ring}, uneven, 0.5},     {{32, 33, 34}, {ring, slope, ring}, constant_one, 0},
      {{34, 32, 40}, {value, ring, slope}, uneven, 0},      {{90, 80, 5}, {ring, ring, slope}, uneven, 1}};
  std::vector<SharedCase> tried;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (testing::is_tried(i, 2)) tried.push_back(all[i]);
  }
  return tried;
}

std::string words_on(const SharedCase& given) {
  return fmt::format("{} x {} x {}", given.cells[0], given.cells[1], given.cells[2]);
}

/// nullopt if the method does not fit.
std::optional<std::vector<double>> solved(const StencilMatrix& matrix, const SolveOptions& options, int threads) {
  std::optional<LinearSolver> solver;
  try {
    solver.emplace(matrix, options, Team(threads));
  } catch (const Error&) {
    return std::nullopt;
  }
  const std::vector<double> b = arbitrary_values(matrix.size(), 3);
  std::vector<double> x(b.size(), 0.0);
  for (int i = 0; i < 2; ++i) solver->solve(b, x);  // the first solve verifies Fourier series
  const SolveReport report = solver->solve(b, x);
  x.insert(x.end(), {report.residual, report.incompatible, static_cast<double>(report.iterations)});
  return x;
}

TEST(SolvesByTeams, HaveTheBitsOfOneThread) {
  int compared = 0;
  for (const SharedCase& given : large_cases()) {
    const StencilMatrix matrix = diffusion(given.cells, given.walls, given.shift, given.k);
    for (const SolverMethod method : {SolverMethod::tridiagonal, SolverMethod::fourier, SolverMethod::multigrid,
                                      SolverMethod::cg, SolverMethod::bicgstab, SolverMethod::gmres}) {
      for (const auto& [preconditioning, rounding] : {std::pair{Preconditioning::automatic, 0x1p-52},
                                                      {Preconditioning::none, 0x1p-52},
                                                      {Preconditioning::automatic, 0x1p-29}}) {
        const bool has_one = method >= SolverMethod::cg, has_cycles = method >= SolverMethod::multigrid;
        if (!has_one && preconditioning == Preconditioning::none) continue;
        if (!has_cycles && rounding > 0x1p-52) continue;  // floats are used for cycles only
        const SolveOptions options{.method = method,
                                   .tolerance = 1e-4,
                                   .most_iterations = 8,
                                   .preconditioning = preconditioning,
                                   .rounding = rounding};
        const auto alone = solved(matrix, options, 1);
        if (!alone) continue;
        const int threads = 2 + compared++ % 2;
        EXPECT_EQ(solved(matrix, options, threads), alone) << words_on(given) << " " << name_of(method);
      }
    }
  }
  EXPECT_GE(compared, 20);
}

TEST(SolvesByTeams, CyclesHaveTheBitsOfOneThread) {
  for (const SharedCase& given : large_cases()) {
    const StencilMatrix matrix = diffusion(given.cells, given.walls, given.shift, given.k);
    for (const SmootherKind smoother : {SmootherKind::red_black, SmootherKind::jacobi, SmootherKind::chebyshev}) {
      for (const bool is_symmetric : {false, true}) {
        const auto made = [&](int threads) {
          std::string why;
          auto multigrid = Multigrid::of(matrix, NullSpace(matrix, 0x1p-52),
                                         {.is_symmetric = is_symmetric, .smoother = smoother, .team = threads}, why);
          std::vector<double> b = arbitrary_values(matrix.size(), 5);
          Numbers right(multigrid->size()), x(multigrid->size());
          multigrid->pack_right(b, right);
          if (is_symmetric) {
            multigrid->cycle(right, x);
          } else {
            multigrid->iterate(right, x, 1e-12, 0, 3);
          }
          multigrid->unpack(x, b);
          return b;
        };
        const std::vector<double> alone = made(1);
        for (const int threads : {2, 3}) EXPECT_EQ(made(threads), alone) << words_on(given);
      }
    }
  }
}

/// Lines that differ from one another, along each axis.
TEST(SolvesByTeams, LinesHaveTheBitsOfOneThread) {
  for (const auto& [cells, axis] :
       {std::pair<GridCells, std::size_t>{{255, 170, 1}, 0}, {{171, 256, 1}, 1}, {{40, 33, 31}, 2}}) {
    StencilMatrix matrix;
    matrix.cells = cells;
    matrix.periodic[axis] = true;
    const std::int64_t step = axis == 0 ? 1 : axis == 1 ? cells[0] : cells[0] * cells[1];
    for (const int along : {0, 1, -1}) {
      matrix.offsets.emplace_back()[axis] = along;
      std::vector<double>& values = matrix.values.emplace_back();
      for (std::int64_t cell = 0; cell < matrix.size(); ++cell) {
        const auto line = static_cast<double>(axis == 0 ? cell / cells[0] : cell % step);
        values.push_back(along == 0 ? 2 + line : 0.3 * along);
      }
    }
    const auto alone = solved(matrix, {.method = SolverMethod::fourier}, 1);
    ASSERT_TRUE(alone);
    for (const int threads : {2, 3}) EXPECT_EQ(solved(matrix, {.method = SolverMethod::fourier}, threads), alone);
  }
}

/// Lengths around those of the parts.
TEST(SolvesByTeams, SumsHaveTheBitsOfOneThread) {
  for (const std::int64_t size : {0, 1, 15, 4095, 4096, 4097, 32767, 32768, 50001, 300001}) {
    const std::vector<double> a = arbitrary_values(size, 1), b = arbitrary_values(size, 2);
    for (const int threads : {2, 3}) {
      const Team team(threads);
      EXPECT_EQ(dot(a, b, team), dot(a, b)) << size;
      EXPECT_EQ(sums_of(a, team).sum, sums_of(a).sum) << size;
      EXPECT_EQ(factor_into_range(a, team), 1) << size;
      std::vector<double> sum = b;
      add_multiple(0.5, a, sum, team);
      for (std::size_t i = 0; i < sum.size(); ++i) ASSERT_EQ(sum[i], b[i] + 0.5 * a[i]) << size;
      EXPECT_TRUE(are_finite(a, team)) << size;
      if (size == 0) continue;
      std::vector<double> broken = a;
      broken.back() = NAN;
      EXPECT_FALSE(are_finite(broken, team)) << size;
      EXPECT_EQ(factor_into_range(broken, team), 0) << size;
    }
  }
}

/// Row by row equals multiply on whole fields, on lines, planes and in space.
TEST(SolvesByTeams, RowsAreThoseOfWholeFields) {
  for (const GridCells& cells :
       {GridCells{40, 1, 1}, {1, 31, 1}, {200, 176, 1}, {37, 19, 1}, {16, 12, 10}, {1, 9, 14}}) {
    for (const auto& wall : all_walls) {
      const StencilMatrix matrix = diffusion(cells, {wall, ring, slope}, 0.5, constant_one);
      for (const int threads : {1, 2}) {
        LinearSolver solver(matrix, {.method = SolverMethod::fourier}, Team(threads));
        std::vector<double> b = arbitrary_values(matrix.size(), 4), x(b.size()), of_rows(b.size(), 7.0);
        const ReadRowsOf<double> read = [&](std::int64_t first, std::span<double> values) {
          std::copy_n(b.begin() + first, values.size(), values.begin());
        };
        const WriteRowsOf<double> write = [&](std::int64_t first, std::span<const double> values) {
          std::ranges::copy(values, of_rows.begin() + first);
        };
        EXPECT_FALSE(solver.solve_rows(read, write)) << "nobody knows whether the series are right";
        solver.solve(b, x);
        const auto report = solver.solve_rows(read, write);
        ASSERT_TRUE(report);
        EXPECT_EQ(of_rows, x) << cells[0] << " " << cells[1] << " " << cells[2];
        b.back() = NAN;
        EXPECT_FALSE(solver.solve_rows(read, write));
        b.back() = 1e200;
        EXPECT_FALSE(solver.solve_rows(read, write)) << "squares are no numbers";
        EXPECT_EQ(of_rows, x) << "nothing is written";
      }
    }
  }
}

/// In floats for entries that are no more accurate: as accurate as the rounding of a transform, for any number of
/// threads.
TEST(SolvesByTeams, SeriesOfFloatsAreThoseOfDoubles) {
  for (const GridCells& cells :
       {GridCells{40, 1, 1}, {1, 31, 1}, {200, 176, 1}, {37, 19, 1}, {16, 12, 10}, {1, 9, 14}, {4, 3, 1}}) {
    for (const auto& wall : all_walls) {
      for (const double shift : {0.0, 0.5}) {
        const StencilMatrix matrix = diffusion(cells, {wall, ring, slope}, shift, constant_one);
        std::vector<float> first;
        for (const int threads : {1, 2}) {
          LinearSolver solver(matrix, {.method = SolverMethod::fourier, .rounding = 0x1p-23}, Team(threads));
          std::vector<double> b(static_cast<std::size_t>(matrix.size())), x(b.size());
          std::ranges::copy(arbitrary_values(matrix.size(), 4), b.begin());
          std::vector<float> right(b.begin(), b.end()), made(b.size());
          solver.solve(b, x);
          if (!solver.has_floats()) continue;
          const ReadRowsOf<float> read = [&](std::int64_t from, std::span<float> values) {
            std::copy_n(right.begin() + from, values.size(), values.begin());
          };
          const WriteRowsOf<float> write = [&](std::int64_t from, std::span<const float> values) {
            std::ranges::copy(values, made.begin() + from);
          };
          ASSERT_TRUE(solver.solve_rows(read, write));
          const double largest =
              std::abs(*std::ranges::max_element(x, {}, [](double value) { return std::abs(value); }));
          for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(made[i], x[i], 1e-5 * largest) << i;
          if (first.empty()) first = made;
          EXPECT_EQ(made, first);
        }
        if (cells[0] == 200) EXPECT_FALSE(first.empty()) << "by doubles";
      }
    }
  }
}

/// The hash covers the interior cells with their positions, and nothing else.
TEST(SolvesByTeams, HashesAreOfTheInterior) {
  for (const int real : {DPDE_F64, DPDE_F32}) {
    const dpde_layout layout = with_three_axes(make_layout(std::vector<int64_t>{200, 176}, {2, 1, 0}, real));
    Field field(layout, 1);
    const auto base = static_cast<char*>(field.base());
    const std::int64_t bytes = real == DPDE_F32 ? 4 : 8;
    const std::vector<double> values = arbitrary_values(200 * 176, 3);
    write_cells(layout, base, values);
    const std::uint64_t hash = hash_of(layout, base);
    EXPECT_EQ(hash_of(layout, base, Team(2)), hash);
    EXPECT_NE(hash_of(layout, base, 1, hash), hash) << "what was before counts";
    std::memset(base - bytes, 1, static_cast<std::size_t>(bytes));
    EXPECT_EQ(hash_of(layout, base), hash) << "a ghost cell";
    std::vector<char> rows(200 * 176 * static_cast<std::size_t>(bytes));
    copy_to_rows(layout, base, rows.data(), Team(2));
    base[17 * layout.stride[1] * bytes + 33 * bytes] ^= 1;
    EXPECT_NE(hash_of(layout, base), hash);
    copy_from_rows(layout, rows.data(), base, Team(2));
    EXPECT_EQ(hash_of(layout, base), hash);
    std::swap_ranges(base, base + bytes, base + layout.stride[1] * bytes);
    EXPECT_NE(hash_of(layout, base), hash) << "the same values elsewhere";
  }
}

TEST(SolvesByTeams, NothingIsAllocatedInASolve) {
  const StencilMatrix matrix = diffusion({200, 176, 1}, {ring, ring, ring}, 0.5, constant_one);
  const std::vector<double> b = arbitrary_values(matrix.size(), 7);
  for (const auto& [method, rounding] : {std::pair{SolverMethod::fourier, 0x1p-52},
                                         {SolverMethod::cg, 0x1p-52},
                                         {SolverMethod::multigrid, 0x1p-52},
                                         {SolverMethod::cg, 0x1p-29},
                                         {SolverMethod::multigrid, 0x1p-29},
                                         {SolverMethod::bicgstab, 0x1p-29}}) {
    LinearSolver solver(matrix, {.method = method, .tolerance = 1e-8, .rounding = rounding}, Team(2));
    std::vector<double> x(b.size(), 0.0);
    solver.solve(b, x);  // starts the threads
    const long before = allocations();
    EXPECT_TRUE(solver.solve(b, x).converged);
    EXPECT_EQ(allocations(), before) << name_of(method);
  }
}

}  // namespace
}  // namespace dpde
