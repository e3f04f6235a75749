// SPDX-License-Identifier: Apache-2.0
// Solves for several fields against dense factorisations, and Newton's method on equations with known solutions; only
// the first solve allocates memory.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "allocations.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"
#include "exec/newton_solve.h"
#include "solve/operator/coupled_matrix.h"
#include "support/dense.h"

namespace dpde {
namespace {

/// Numbers between -1 and 1, equal in each run.
double arbitrary(std::size_t number) {
  return std::sin(12.9898 * static_cast<double>(number) + 78.233 * std::cos(static_cast<double>(number)));
}

/// Each unknown is coupled to all unknowns of the cells within the stencil radius, with weights that differ everywhere.
test::DenseMatrix operator_of(const CoupledShape& shape) {
  const auto& n = shape.cells;
  const std::int64_t cells = n[0] * n[1] * n[2], size = cells * shape.unknowns;
  test::DenseMatrix matrix(size);
  const auto distance = [&](std::int64_t i, std::int64_t j, std::size_t axis) {
    const std::int64_t d = std::abs(i - j);
    return shape.periodic[axis] ? std::min(d, n[axis] - d) : d;
  };
  const auto place = [&](std::int64_t cell) {
    return std::array{cell % n[0], cell / n[0] % n[1], cell / (n[0] * n[1])};
  };
  for (std::int64_t row = 0; row < size; ++row) {
    for (std::int64_t column = 0; column < size; ++column) {
      const auto a = place(row % cells), b = place(column % cells);
      bool is_near = true;
      for (std::size_t axis = 0; axis < 3; ++axis)
        is_near = is_near && (shape.reach[axis] < 0 || distance(a[axis], b[axis], axis) <= shape.reach[axis]);
      if (is_near)
        matrix(static_cast<std::size_t>(row), static_cast<std::size_t>(column)) =
            arbitrary(static_cast<std::size_t>(row * size + column)) + (row == column ? 9 : 0);
    }
  }
  return matrix;
}

TEST(CoupledMatrix, SolvesAsDenseFactorsDo) {
  using Method = CoupledMatrix::Method;
  for (const CoupledShape& shape : {CoupledShape{{9, 1, 1}, {false, false, false}, {1, 0, 0}, 3},
                                    CoupledShape{{9, 1, 1}, {true, false, false}, {2, 0, 0}, 2},
                                    CoupledShape{{3, 1, 1}, {true, false, false}, {2, 0, 0}, 2},
                                    CoupledShape{{1, 1, 1}, {true, true, true}, {1, 1, 1}, 3},
                                    CoupledShape{{7, 1, 1}, {false, false, false}, {-1, 0, 0}, 1},
                                    CoupledShape{{6, 5, 1}, {true, false, false}, {1, 1, 0}, 2},
                                    CoupledShape{{4, 3, 5}, {false, true, true}, {1, 1, 1}, 2},
                                    CoupledShape{{5, 4, 2}, {true, true, true}, {0, 0, 0}, 4}}) {
    const test::DenseMatrix wanted = operator_of(shape);
    const std::size_t size = wanted.size;
    std::vector<double> right(size), x(size);
    for (std::size_t i = 0; i < size; ++i) right[i] = arbitrary(i);
    const auto image = [&](std::span<const double> values, std::span<double> made) {
      test::multiply(wanted, values, made);
    };
    const std::vector<double> exact = test::regular_solution(wanted, right);
    for (const Method method : {Method::automatic, Method::direct, Method::bicgstab}) {
      CoupledMatrix matrix(shape, method, 1e-13);
      ASSERT_TRUE(matrix.make(std::ref(image)));
      ASSERT_TRUE(matrix.solve(right, x));
      const long before = test::allocations();
      ASSERT_TRUE(matrix.make(std::ref(image)));
      ASSERT_TRUE(matrix.solve(right, x));
      EXPECT_EQ(test::allocations(), before);
      for (std::size_t i = 0; i < size; ++i) EXPECT_NEAR(x[i], exact[i], 1e-12) << i;
    }
  }
}

/// A band matrix of 64 x 64 cells would take 94 s to factorise: sparse factors are used.
TEST(CoupledMatrix, HasSparseFactorsOfAWideBand) {
  const CoupledShape shape{{48, 48, 1}, {true, true, false}, {1, 1, 0}, 2};
  CoupledMatrix matrix(shape, CoupledMatrix::Method::direct, 1e-12);
  const std::size_t cells = 48 * 48;
  const auto image = [](std::span<const double> u, std::span<double> made) {
    for (std::size_t y = 0; y < 48; ++y) {
      for (std::size_t x = 0; x < 48; ++x) {
        const std::size_t here = x + 48 * y, east = (x + 1) % 48 + 48 * y, north = x + 48 * ((y + 1) % 48);
        made[here] = 5 * u[here] - 2 * u[east] - u[north] + u[cells + here];
        made[cells + here] = 4 * u[cells + here] - u[cells + north] - u[east];
      }
    }
  };
  ASSERT_TRUE(matrix.make(std::ref(image)));
  std::vector<double> wanted(2 * cells), right(2 * cells), x(2 * cells);
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] = arbitrary(i);
  image(wanted, right);
  ASSERT_TRUE(matrix.solve(right, x));
  for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(x[i], wanted[i], 1e-11) << i;
}

TEST(CoupledMatrix, SaysThatItIsSingular) {
  for (const auto method : {CoupledMatrix::Method::direct, CoupledMatrix::Method::bicgstab}) {
    CoupledMatrix matrix({{4, 1, 1}, {}, {0, 0, 0}, 2}, method, 1e-10);
    EXPECT_FALSE(matrix.make([](std::span<const double> values, std::span<double> made) {
      for (std::size_t i = 0; i < 4; ++i) made[i] = made[4 + i] = values[i] + values[4 + i];
    }));
  }
}

/// x - h*f(x, y) = b in each cell. Fields 0, 1: unknowns; 2, 3: operator applied to them; 4, 5: right-hand sides; 6, 7:
/// changes; 8, 9: operator applied to these; 10, 11: residuals.
class Reaction {
 public:
  explicit Reaction(double h) : h_(h), layout_(make_layout(std::array<std::int64_t, 1>{cells}, {1, 0, 0})) {
    for (std::size_t i = 0; i < memory_.size(); ++i) {
      memory_[i].assign(cells + 2, 0.0);
      fields_[i] = memory_[i].data() + 1;
      names_[i] = "f";
    }
    names_[0] = "x";
    names_[1] = "y";
    program_.fields = names_.data();
    step_ = {.count = 2, .images = &numbers_[8], .rights = &numbers_[10], .unknowns = &numbers_[6], .tolerance = 1e-10};
    step_.coefficient_count = 2;
    step_.coefficients = &numbers_[0];
    step_.is_linear = 1;
    solve_ = {.count = 2, .images = &numbers_[2], .rights = &numbers_[4], .unknowns = &numbers_[0], .tolerance = 1e-10};
    solve_.step = &step_;
  }

  double& at(int field, std::size_t cell) { return memory_[static_cast<std::size_t>(field)][cell + 1]; }
  NewtonSolve solver() { return {solve_, program_, layout_, shelf_}; }

  void run(NewtonSolve& newton) {
    const auto apply = [this] {
      for (std::size_t i = 0; i < cells; ++i) {
        const double x = at(0, i), y = at(1, i);
        at(2, i) = x - h_ * (1 - 3 * x + x * x * y);
        at(3, i) = y - h_ * (2 * x - x * x * y);
      }
    };
    const auto apply_step = [this] {
      for (std::size_t i = 0; i < cells; ++i) {
        const double x = at(0, i), y = at(1, i), dx = at(6, i), dy = at(7, i);
        at(8, i) = dx - h_ * (-3 * dx + 2 * x * y * dx + x * x * dy);
        at(9, i) = dy - h_ * (2 * dx - 2 * x * y * dx - x * x * dy);
      }
    };
    newton.run(fields_.data(), nullptr, std::ref(apply), std::ref(apply_step));
  }

  static constexpr int cells = 5;

 private:
  double h_;
  dpde_layout layout_;
  std::array<std::vector<double>, 12> memory_;
  std::array<void*, 12> fields_{};
  std::array<const char*, 12> names_{};
  std::array<int32_t, 12> numbers_{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  dpde_program program_{};
  dpde_solve solve_{}, step_{};
  SolverShelf shelf_;
};

TEST(NewtonSolve, FindsWhatTheRightSidesWereMadeOf) {
  for (const double h : {1e-3, 0.3, 1.0}) {
    Reaction reaction(h);
    NewtonSolve newton = reaction.solver();
    const auto set_rights = [&](double shift) {
      for (std::size_t i = 0; i < Reaction::cells; ++i) {
        const double x = 0.4 + 0.02 * static_cast<double>(i) + shift, y = 1 + shift;
        reaction.at(4, i) = x - h * (1 - 3 * x + x * x * y);
        reaction.at(5, i) = y - h * (2 * x - x * x * y);
      }
    };
    set_rights(0);
    reaction.run(newton);
    const long before = test::allocations();
    set_rights(0.1);
    reaction.run(newton);
    EXPECT_EQ(test::allocations(), before);
    for (std::size_t i = 0; i < Reaction::cells; ++i) {
      EXPECT_NEAR(reaction.at(0, i), 0.5 + 0.02 * static_cast<double>(i), 1e-14);
      EXPECT_NEAR(reaction.at(1, i), 1.1, 1e-14);
    }
  }
}

/// Non-finite values stay NaN, so that checks of the run detect them.
TEST(NewtonSolve, LeavesWhatIsNotFiniteAsItIs) {
  Reaction reaction(0.1);
  NewtonSolve newton = reaction.solver();
  reaction.at(4, 2) = std::nan("");
  reaction.run(newton);
  EXPECT_TRUE(std::isnan(reaction.at(0, 2)));
}

}  // namespace
}  // namespace dpde
