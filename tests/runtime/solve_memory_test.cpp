// SPDX-License-Identifier: Apache-2.0
// The reported memory of solves is the memory that they use.
#include "dpde/runtime/solve_memory.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "solve/operator/operator_probe.h"
#include "solve/solver/linear_solver.h"
#include "solve_operators.h"

namespace dpde::test {
namespace {

double bytes_in_use() {
#ifdef __GLIBC__
  const auto all = mallinfo2();
  return static_cast<double>(all.uordblks + all.hblkhd);
#else
  return 0;
#endif
}

struct MeasuredSolver {
  GridCells cells;
  std::pair<Wall, Wall> walls;
  bool is_constant;
  SolverMethod method;
  int of_solve;  // DPDE_SOLVE_*
  bool changes = false, has_floats = false;
};

double bytes_of_measured(const MeasuredSolver& one) {
  std::array<std::int64_t, 3> reach{};
  for (std::size_t axis = 0; axis < 3; ++axis) reach[axis] = one.cells[axis] > 1 ? 1 : 0;
  const StencilMatrix matrix = diffusion(one.cells, {one.walls, one.walls, one.cells[2] > 1 ? one.walls : all_walls[0]},
                                         1, one.is_constant ? constant_one : uneven);
  const LinearImage image = [&](std::span<const double> x, std::span<double> y) { multiply(matrix, x, y); };
  const double before = bytes_in_use();
  OperatorProbe probe(one.cells, matrix.periodic, reach, 0x1p-52, "p");
  SolveOptions options{.method = one.method};
  if (one.has_floats) options.rounding = 0x1p-29;
  LinearSolver solver(std::make_shared<const GridOperator>(probe.find(image)), options);
  if (!one.changes) return bytes_in_use() - before;
  std::vector<double> room(2 * static_cast<std::size_t>(matrix.size()));
  const std::span<double> values(room.data(), room.size() / 2), made(values.data() + values.size(), values.size());
  auto found = std::const_pointer_cast<GridOperator>(solver.give_operator());
  *found = probe.find(image, std::move(*found), {values, made});
  EXPECT_TRUE(solver.renew(std::move(found)));
  return bytes_in_use() - before - static_cast<double>(room.size() * sizeof(double));
}

TEST(MemoryOfSolves, IsWhatIsSaid) {
  if (bytes_in_use() == 0) GTEST_SKIP() << "nobody counts bytes here";
  for (const GridCells& cells : {GridCells{250, 260, 1}, GridCells{33, 30, 32}}) {
    for (const auto& walls : {all_walls[0], all_walls[1], all_walls[2]}) {
      for (const auto& [method, of_solve, varies] : {std::tuple{SolverMethod::fourier, DPDE_SOLVE_FOURIER, false},
                                                     std::tuple{SolverMethod::cg, DPDE_SOLVE_CG, true},
                                                     std::tuple{SolverMethod::multigrid, DPDE_SOLVE_MULTIGRID, true},
                                                     std::tuple{SolverMethod::bicgstab, DPDE_SOLVE_BICGSTAB, true},
                                                     std::tuple{SolverMethod::gmres, DPDE_SOLVE_GMRES, true}}) {
        for (const auto& [is_constant, changes, has_floats] : {std::tuple{true, false, false},
                                                               {false, false, false},
                                                               {false, true, false},
                                                               {true, false, true},
                                                               {false, true, true}}) {
          if ((!is_constant && !varies) || (changes && walls != all_walls[1])) continue;
          if (has_floats && (!varies || walls != all_walls[1])) continue;
          const MeasuredSolver one{cells, walls, is_constant, method, of_solve, changes, has_floats};
          SolveShape shape{.cells = cells,
                           .is_constant = is_constant,
                           .method = of_solve,
                           .has_floats = has_floats,
                           .changes = changes};
          for (std::size_t axis = 0; axis < 3; ++axis) {
            shape.reach[axis] = cells[axis] > 1 ? 1 : 0;
            shape.periodic[axis] = cells[axis] > 1 && walls.first == Wall::periodic;
          }
          const SolveMemory said = memory_of(shape);
          const auto of_cells = static_cast<double>(8 * cells[0] * cells[1] * cells[2]);
          const double made = bytes_of_measured(one) + 2 * of_cells;  // a FieldSolve has two such arrays
          EXPECT_NEAR(said.kept / made, 1, 0.15)
              << name_of(method) << " " << is_constant << changes << has_floats << " " << cells[2] << ": "
              << said.kept / of_cells << " fields, " << made / of_cells;
          EXPECT_GE(said.peak, said.kept);
        }
      }
    }
  }
}

}  // namespace
}  // namespace dpde::test
