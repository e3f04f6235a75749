// SPDX-License-Identifier: Apache-2.0
// Iterations with an arbitrary preconditioner: the solution never depends on it, and an approximate inverse saves
// iterations.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "solve/solver/linear_solver.h"
#include "solve_operators.h"

namespace dpde {

using namespace test;

namespace {

struct Named {
  std::string name;
  VectorFunction search;
};

void smooth(const std::vector<double>& r, std::span<double> z, double by) {
  const std::size_t n = r.size();
  for (std::size_t i = 0; i < n; ++i) z[i] = by * (0.5 * r[i] + 0.25 * (r[(i + n - 1) % n] + r[(i + 1) % n]));
}

/// Search directions of all kinds, useful and useless.
std::vector<Named> searches() {
  const auto each = [](auto f) {
    return [f](std::span<const double> r, std::span<double> z) {
      for (std::size_t i = 0; i < r.size(); ++i) z[i] = f(r[i], i);
    };
  };
  const auto smoothed = [](double by) {
    return [by](std::span<const double> r, std::span<double> z) { smooth({r.begin(), r.end()}, z, by); };
  };
  return {{"itself", each([](double r, std::size_t) { return r; })},
          {"minus itself", each([](double r, std::size_t) { return -r; })},
          {"smooth", smoothed(1)},
          {"smooth, of any size and sign", smoothed(-1e-30)},
          {"nothing", each([](double, std::size_t) { return 0.0; })},
          {"no number", each([](double, std::size_t) { return std::nan(""); })},
          {"far too large", each([](double r, std::size_t) { return r < 0 ? -INFINITY : INFINITY; })},
          {"always the same", each([](double, std::size_t i) { return 1.0 + std::sin(3.0 * static_cast<double>(i)); })},
          {"constant", each([](double, std::size_t) { return 0.14; })},
          {"constant but for a little", each([](double r, std::size_t) { return 0.14 + 1e-13 * r; })},
          {"of two values", each([](double r, std::size_t) { return std::tanh(1e3 * r); })},
          {"of two values that vary", each([](double r, std::size_t i) {
             return std::tanh(1e3 * (r + 0.5 * std::sin(3.0 * static_cast<double>(i))));
           })},
          {"bent", each([](double r, std::size_t) { return std::tanh(3 * r) + 0.3 * r * r; })},
          {"of both signs", each([](double r, std::size_t i) { return i % 2 == 0 ? r : -1.1 * r; })},
          {"across", [](std::span<const double> r, std::span<double> z) {
             const std::vector<double> values(r.begin(), r.end());
             for (std::size_t i = 0; i < values.size(); ++i) z[i] = values[(i + 1) % values.size()] - values[i];
           }}};
}

void come_to_the_solution(const StencilMatrix& matrix) {
  const std::vector<double> b = arbitrary_values(matrix.size(), 3);
  for (const SolverMethod method : {SolverMethod::cg, SolverMethod::gmres}) {
    LinearSolver solver(
        matrix,
        {.method = method, .tolerance = 1e-11, .most_iterations = 2000, .preconditioning = Preconditioning::network});
    for (const Named& tried : searches()) {
      std::vector<double> x(b.size(), 0.0);
      const SolveReport report = solver.solve(b, x, &tried.search);
      EXPECT_TRUE(report.converged) << tried.name << " " << name_of(method) << ": " << report.residual;
      EXPECT_FALSE(report.is_indefinite) << tried.name;
      EXPECT_LT(error_of(matrix, b, x), 1e-8) << tried.name << " " << name_of(method);
      EXPECT_LE(report.unaided, report.iterations) << tried.name;
    }
  }
}

/// For a singular operator only the part orthogonal to constants; the constant part is rounding.
TEST(FlexibleIterations, ComeToTheSolutionWhateverTheNetworkIs) {
  using Cells = GridCells;
  for (const double shift : {0.0, 3.0}) {
    for (const auto& wall : all_walls) {
      for (const Coefficient& k : {Coefficient(constant_one), Coefficient(uneven)}) {
        for (const Cells& cells : {Cells{9, 7, 1}, Cells{7, 1, 1}, Cells{6, 4, 1}})
          come_to_the_solution(diffusion(cells, {wall, all_walls[0], all_walls[0]}, shift, k));
      }
    }
  }
}

/// With the residual as direction the iterations are those without a preconditioner.
TEST(FlexibleIterations, AreThePlainOnesAlongTheResidual) {
  const StencilMatrix matrix = diffusion({12, 9, 1}, {all_walls[1], all_walls[0], all_walls[0]}, 0, uneven);
  const std::vector<double> b = arbitrary_values(matrix.size(), 3);
  for (const SolverMethod method : {SolverMethod::cg, SolverMethod::gmres}) {
    const auto solved = [&](Preconditioning preconditioning, const VectorFunction* search) {
      std::vector<double> x(b.size(), 0.0);
      LinearSolver solver(
          matrix, {.method = method, .tolerance = 1e-9, .most_iterations = 500, .preconditioning = preconditioning});
      return solver.solve(b, x, search);
    };
    const SolveReport plain = solved(Preconditioning::none, nullptr);
    for (const char* name : {"itself", "minus itself", "nothing"}) {
      const std::vector<Named> all = searches();
      const auto found = std::ranges::find(all, name, &Named::name);
      const SolveReport own = solved(Preconditioning::network, &found->search);
      EXPECT_LE(std::abs(own.iterations - plain.iterations), 1) << name << " " << name_of(method);
      EXPECT_EQ(own.unaided > 0, name == std::string("nothing")) << name << " " << name_of(method);
    }
  }
}

/// An approximate inverse saves iterations, also for an unsymmetric operator.
TEST(FlexibleIterations, AreSavedByWhatIsNearTheInverse) {
  const StencilMatrix matrix = diffusion({24, 20, 1}, {all_walls[1], all_walls[1], all_walls[0]}, 0, uneven);
  const std::vector<double> b = arbitrary_values(matrix.size(), 3);
  LinearSolver inner(matrix, {.method = SolverMethod::multigrid, .tolerance = 0.3});
  const VectorFunction search = [&](std::span<const double> r, std::span<double> z) {
    const std::vector<double> right(r.begin(), r.end());
    std::ranges::fill(z, 0.0);
    inner.solve(right, z);
  };
  for (const SolverMethod method : {SolverMethod::cg, SolverMethod::gmres}) {
    std::vector<double> x(b.size(), 0.0), y = x;
    const SolveOptions options{.method = method, .tolerance = 1e-9, .most_iterations = 500};
    SolveOptions plain = options, own = options;
    plain.preconditioning = Preconditioning::none;
    own.preconditioning = Preconditioning::network;
    const SolveReport many = LinearSolver(matrix, plain).solve(b, x);
    LinearSolver flexible(matrix, own);
    const SolveReport few = flexible.solve(b, y, &search);
    EXPECT_LT(4 * few.iterations, many.iterations) << name_of(method);
    EXPECT_EQ(few.unaided, 0);
    EXPECT_LT(error_of(matrix, b, y), 1e-6);
  }
}

}  // namespace
}  // namespace dpde
