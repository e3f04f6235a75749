// SPDX-License-Identifier: Apache-2.0
// Solvers with changing coefficients: bit-identical to new solvers, and without allocations from the second change on.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "allocations.h"
#include "solve/operator/operator_probe.h"
#include "solve/solver/solver_shelf.h"
#include "solve_operators.h"

namespace dpde::test {
namespace {

struct RenewedCase {
  std::string what;
  SolveOptions options;
  GridCells cells;
  std::pair<Wall, Wall> walls;
  double shift = 1, wind = 0;
  bool may_allocate = false;
};

/// The coefficients at a time; wind along x makes the matrix unsymmetric.
StencilMatrix matrix_at(const RenewedCase& one, double time) {
  const auto k = [time](std::int64_t cell, std::size_t axis) {
    return 1 + 0.5 * std::sin(0.7 * static_cast<double>(cell) + 2 * static_cast<double>(axis) + time);
  };
  StencilMatrix matrix = diffusion(one.cells, {one.walls, one.walls, one.walls}, one.shift, k);
  const auto next = std::ranges::find(matrix.offsets, std::array{1, 0, 0}) - matrix.offsets.begin();
  std::vector<double>&along = matrix.values[static_cast<std::size_t>(next)], &diagonal = matrix.values.front();
  for (std::size_t i = 0; i < diagonal.size(); ++i) {
    if (along[i] == 0) continue;
    along[i] -= one.wind * (1 + time);
    diagonal[i] += one.wind * (1 + time);
  }
  return matrix;
}

/// Mimics a FieldSolve after coefficients have changed.
class ChangingSolve {
 public:
  ChangingSolve(const RenewedCase& one, const StencilMatrix& first)
      : options_(one.options),
        cells_(one.cells),
        probe_(one.cells, first.periodic, reach_of(one.cells), 0x1p-52, "p"),
        right_(static_cast<std::size_t>(first.size())),
        x_(right_.size()) {}

  const std::vector<double>& solve(const StencilMatrix& matrix, std::span<const double> b) {
    const auto image = [&](std::span<const double> x, std::span<double> y) { multiply(matrix, x, y); };
    store_.give_spare(std::exchange(solver_, nullptr), options_);
    std::shared_ptr<LinearSolver> spare = store_.take_spare(options_, cells_);
    std::shared_ptr<GridOperator> found;
    if (spare != nullptr) found = std::const_pointer_cast<GridOperator>(spare->give_operator());
    if (found == nullptr) found = std::make_shared<GridOperator>();
    *found = probe_.find(std::ref(image), std::move(*found), {right_, x_});
    const LinearSolver* const before = spare.get();
    solver_ = store_.solver_of(std::move(found), options_, 1, std::move(spare));
    is_renewed = solver_.get() == before;
    std::ranges::copy(b, right_.begin());
    std::ranges::fill(x_, 0.0);
    has_converged = solver_->solve(right_, x_).converged;
    return x_;
  }

  bool is_renewed = false, has_converged = false;

 private:
  static std::array<std::int64_t, 3> reach_of(const GridCells& cells) {
    return {1, cells[1] > 1 ? 1 : 0, cells[2] > 1 ? 1 : 0};
  }

  SolveOptions options_;
  GridCells cells_;
  OperatorProbe probe_;
  SolverStore store_;
  std::shared_ptr<LinearSolver> solver_;
  std::vector<double> right_, x_;
};

std::vector<RenewedCase> renewed_cases() {
  using enum SolverMethod;
  const GridCells plane{20, 18, 1}, space{9, 8, 7}, line{70, 1, 1}, large{101, 100, 1};
  const auto periodic = all_walls[0], value = all_walls[1], slope = all_walls[2], mixed = all_walls[3];
  std::vector<RenewedCase> cases;
  for (const auto& [where, walls] : {std::pair{"periodic", periodic}, {"value", value}, {"slope", slope}}) {
    const double shift = walls == value ? 0 : 1;
    for (const auto& [grid, cells] : {std::pair{"plane", plane}, {"space", space}}) {
      const auto add = [&](const char* what, const SolveOptions& options, double wind = 0, bool may_allocate = false) {
        const std::string all = std::string(what) + ", " + where + ", " + grid;
        cases.push_back({all, options, cells, walls, shift, wind, may_allocate});
      };
      add("multigrid", {.method = multigrid});
      add("cg with multigrid", {.method = cg});
      add("cg alone", {.method = cg, .most_iterations = 500, .preconditioning = Preconditioning::none});
      add("multigrid in f32", {.method = multigrid, .rounding = 0x1p-29});
      add("cg with multigrid in f32", {.method = cg, .rounding = 0x1p-29});
      add("bicgstab with multigrid in f32", {.method = bicgstab, .rounding = 0x1p-29}, 0.5);
      add("gmres with multigrid", {.method = gmres}, 0.5);
      add("bicgstab with multigrid", {.method = bicgstab}, 0.5);
      add("direct", {.method = direct}, 0.5, true);  // Eigen's factorisation
    }
  }
  cases.push_back({"singular multigrid", {.method = multigrid}, plane, slope, 0});
  cases.push_back({"singular cg", {.method = cg}, plane, periodic, 0});
  cases.push_back({"singular multigrid in f32", {.method = multigrid, .rounding = 0x1p-29}, plane, slope, 0});
  cases.push_back({"along a line", {}, line, mixed, 0});
  cases.push_back({"around a ring", {}, line, periodic, 1});
  cases.push_back({"automatic", {}, large, value, 0});
  cases.push_back({"automatic, unsymmetric", {}, large, mixed, 1, 0.5});
  return cases;
}

TEST(RenewedSolvers, HaveTheBitsOfNewOnesAndAllocateNothing) {
  for (const RenewedCase& one : renewed_cases()) {
    std::vector<StencilMatrix> matrices;
    for (int time = 0; time < 4; ++time) matrices.push_back(matrix_at(one, 0.3 * time));
    const std::vector<double> b = arbitrary_values(matrices.front().size(), 3);
    ChangingSolve changing(one, matrices.front());
    for (std::size_t time = 0; time < matrices.size(); ++time) {
      const long before = allocations();
      const std::vector<double>& x = changing.solve(matrices[time], b);
      const long made = allocations() - before;
      EXPECT_TRUE(changing.has_converged) << one.what;
      EXPECT_EQ(changing.is_renewed, time > 0) << one.what << ", time " << time;
      if (time > 1 && !one.may_allocate) EXPECT_EQ(made, 0) << one.what << ", time " << time;
      if (time == 0 || time == 2) continue;  // new solvers need time
      ChangingSolve fresh(one, matrices.front());
      EXPECT_EQ(x, fresh.solve(matrices[time], b)) << one.what << ", time " << time;
    }
  }
}

/// A spare solver, replaced by a shared one, is available for the next operator.
TEST(RenewedSolvers, AreSharedWhereOperatorsAreTheSame) {
  const RenewedCase one{"", {.method = SolverMethod::cg}, {20, 18, 1}, all_walls[1], 0};
  SolverStore store;
  const auto operator_at = [&](double time) {
    return std::make_shared<const GridOperator>(matrix_at(one, time), 0x1p-52);
  };
  std::shared_ptr<LinearSolver> forward = store.solver_of(operator_at(0), one.options, 1);
  std::shared_ptr<LinearSolver> backward = store.solver_of(operator_at(0), one.options, 1);
  EXPECT_EQ(forward, backward);
  store.give_spare(std::exchange(forward, nullptr), one.options);
  EXPECT_EQ(store.take_spare(one.options, one.cells), nullptr);  // another user holds it
  forward = store.solver_of(operator_at(1), one.options, 1);
  EXPECT_NE(forward, backward);
  const LinearSolver* const first = backward.get();
  store.give_spare(std::exchange(backward, nullptr), one.options);
  EXPECT_EQ(store.take_spare({.method = SolverMethod::direct}, one.cells), nullptr);
  EXPECT_EQ(store.take_spare(one.options, {20, 19, 1}), nullptr);
  std::shared_ptr<LinearSolver> spare = store.take_spare(one.options, one.cells);
  EXPECT_EQ(spare.get(), first);
  spare->give_operator();
  backward = store.solver_of(operator_at(1), one.options, 1, std::move(spare));
  EXPECT_EQ(forward, backward);
  EXPECT_EQ(store.take_spare(one.options, one.cells).get(), first);
}

/// If a method no longer fits, or another one does, a new solver is created.
TEST(RenewedSolvers, GiveWayToOthers) {
  const RenewedCase uneven_case{"", {}, {102, 100, 1}, all_walls[1], 0};
  const StencilMatrix varying = matrix_at(uneven_case, 0),
                      constant =
                          diffusion(uneven_case.cells, {all_walls[1], all_walls[1], all_walls[1]}, 0, constant_one);
  const auto operator_of = [](const StencilMatrix& matrix) {
    return std::make_shared<const GridOperator>(matrix, 0x1p-52);
  };
  LinearSolver solver(operator_of(varying), {});
  EXPECT_EQ(solver.method(), SolverMethod::cg);
  EXPECT_FALSE(solver.renew(operator_of(constant)));
  EXPECT_EQ(LinearSolver(operator_of(constant), {}).method(), SolverMethod::fourier);
  LinearSolver cg(operator_of(varying), {.method = SolverMethod::cg});
  EXPECT_FALSE(cg.renew(operator_of(matrix_at({"", {}, uneven_case.cells, all_walls[1], 0, 0.5}, 0))));
  const RenewedCase with_wind{"", {}, uneven_case.cells, all_walls[1], 0, 0.5};
  LinearSolver unsymmetric(operator_of(matrix_at(with_wind, 0)), {});
  EXPECT_EQ(unsymmetric.method(), SolverMethod::bicgstab);
  EXPECT_FALSE(unsymmetric.renew(operator_of(varying)));
  LinearSolver singular(operator_of(matrix_at({"", {}, {20, 18, 1}, all_walls[2], 0}, 0)),
                        {.method = SolverMethod::cg});
  EXPECT_FALSE(singular.renew(operator_of(matrix_at({"", {}, {20, 18, 1}, all_walls[2], 1}, 0))));
}

}  // namespace
}  // namespace dpde::test
