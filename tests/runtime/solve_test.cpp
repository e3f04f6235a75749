// SPDX-License-Identifier: Apache-2.0
// Linear solvers against dense pseudo-inverses, exact solutions and each other.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <vector>

#include "dpde/runtime/error.h"
#include "solve/operator/operator_probe.h"
#include "solve/solver/linear_solver.h"
#include "solve_operators.h"

namespace dpde {

using namespace test;

namespace {

/// Tests the automatic choice and each other method that fits the operator.
void expect_solved(const StencilMatrix& matrix, const std::string& name) {
  const std::vector<double> b = arbitrary_values(matrix.size(), 3);
  int solved = 0;
  for (const SolverMethod method : {SolverMethod::automatic, SolverMethod::direct, SolverMethod::tridiagonal,
                                    SolverMethod::fourier, SolverMethod::multigrid, SolverMethod::cg}) {
    std::optional<LinearSolver> solver;
    try {
      solver.emplace(matrix, SolveOptions{.method = method, .tolerance = 1e-12});
    } catch (const Error&) {
      EXPECT_TRUE(method != SolverMethod::automatic && method != SolverMethod::direct) << name;
      continue;
    }
    std::vector<double> x(b.size(), 0.0);
    const SolveReport report = solver->solve(b, x);
    EXPECT_TRUE(report.converged) << name << " " << name_of(method) << ": " << report.residual;
    EXPECT_LT(error_of(matrix, b, x), 2e-10) << name << " " << name_of(method) << " " << solver->reason();
    ++solved;
  }
  EXPECT_GE(solved, 2) << name;
}

TEST(LinearSolvers, AgreeWithTheDensePseudoInverseOnEverySmallExtent) {
  for (const auto& wall : all_walls) {
    for (std::int64_t n = 1; n <= 7; ++n) {
      for (const Coefficient& k : {Coefficient(constant_one), Coefficient(uneven)}) {
        for (const double shift : {0.0, 3.0}) {
          const auto line = diffusion({n, 1, 1}, {wall, all_walls[0], all_walls[0]}, shift, k);
          expect_solved(line, "1-D, " + std::to_string(n));
          for (const auto& other : all_walls)
            expect_solved(diffusion({n, 8 - n, 1}, {wall, other, all_walls[0]}, shift, k), "2-D, " + std::to_string(n));
        }
      }
    }
  }
  expect_solved(diffusion({5, 4, 3}, {all_walls[0], all_walls[1], all_walls[2]}, 0, uneven), "3-D");
  expect_solved(diffusion({4, 3, 6}, {all_walls[2], all_walls[2], all_walls[2]}, 0, constant_one), "3-D closed");
}

/// Two rooms separated by a block: each room has its own constant, the block is 0.
TEST(LinearSolvers, PartsThatAreCutOffAreEachByThemselves) {
  const auto in_block = [](std::int64_t x) { return x == 4 || x == 5; };
  const Coefficient k = [&](std::int64_t cell, std::size_t axis) {
    const std::int64_t x = cell % 10, next = axis == 0 ? x + 1 : x;
    return in_block(x) || in_block(next) ? 0.0 : 1.0;
  };
  const StencilMatrix matrix = diffusion({10, 6, 1}, {all_walls[2], all_walls[2], all_walls[0]}, 0, k);
  expect_solved(matrix, "rooms");
  const std::vector<double> b = arbitrary_values(60, 5);
  std::vector<double> x(60, 0.0);
  LinearSolver solver(matrix, {.method = SolverMethod::cg});
  EXPECT_GT(solver.solve(b, x).incompatible, 0.01);
  double left = 0, right = 0;
  for (std::size_t i = 0; i < 60; ++i) {
    if (in_block(static_cast<std::int64_t>(i % 10))) {
      EXPECT_EQ(x[i], 0);
    }
    (i % 10 < 4 ? left : right) += x[i];
  }
  EXPECT_NEAR(left, 0, 1e-12);
  EXPECT_NEAR(right, 0, 1e-12);
}

/// The best multiple of a guess: the solution itself needs no iterations, and no guess is worse than none.
TEST(LinearSolvers, BeginWithTheBestMultipleOfAGuess) {
  const StencilMatrix matrix = diffusion({12, 9, 1}, {all_walls[1], all_walls[2], all_walls[0]}, 0, uneven);
  const std::vector<double> b = arbitrary_values(108, 1);
  for (const SolverMethod method : {SolverMethod::cg, SolverMethod::multigrid, SolverMethod::gmres}) {
    LinearSolver solver(matrix, {.method = method, .tolerance = 1e-10});
    std::vector<double> solution(108, 0.0), x(108, 0.0);
    const int cold = solver.solve(b, solution).iterations;
    for (const double factor : {1.0, -1e-3, 1e5}) {
      std::vector<double> guess = solution;
      for (double& value : guess) value *= factor;
      solver.begin(b, guess, x);
      for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(x[i], solution[i], 1e-9 * std::abs(solution[i]));
      EXPECT_LE(solver.solve(b, x).iterations, 1);
    }
    std::vector<double> other = arbitrary_values(108, 2);
    solver.begin(b, other, x);
    std::vector<double> image(b.size());
    multiply(dense_of(matrix), x, image);
    double left = 0, size = 0;
    for (std::size_t i = 0; i < b.size(); ++i) {
      left += (image[i] - b[i]) * (image[i] - b[i]);
      size += b[i] * b[i];
    }
    EXPECT_LE(std::sqrt(left), std::sqrt(size) * (1 + 1e-12));
    const SolveReport report = solver.solve(b, x);
    EXPECT_TRUE(report.converged);
    EXPECT_LE(report.iterations, cold + 2);
    for (const double nothing : {0.0, std::nan("")}) {
      std::vector<double> guess(108, nothing);
      solver.begin(b, guess, x);
      EXPECT_EQ(x, std::vector<double>(108, 0.0));
    }
  }
}

/// <y, A^+ b> = <A^+T y, b>, for an unsymmetric operator.
TEST(LinearSolvers, OfTheTransposeIsTheTranspose) {
  for (const bool is_periodic : {true, false}) {
    const auto& wall = all_walls[is_periodic ? 0 : 1];
    StencilMatrix matrix = diffusion({12, 9, 1}, {wall, wall, all_walls[0]}, 2, uneven);
    for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
      for (double& value : matrix.values[k]) value += matrix.offsets[k][0] * (value == 0 ? 0.0 : 20.0);
    }
    const std::vector<double> b = arbitrary_values(108, 1), y = arbitrary_values(108, 2);
    for (const SolverMethod method : {SolverMethod::automatic, SolverMethod::bicgstab, SolverMethod::gmres}) {
      std::vector<double> x(108, 0.0), z(108, 0.0);
      const SolveOptions options{.method = method, .tolerance = 1e-13};
      EXPECT_TRUE(LinearSolver(matrix, options).solve(b, x).converged);
      EXPECT_TRUE(LinearSolver(transposed(matrix), options).solve(y, z).converged);
      double forward = 0, reverse = 0, size = 0;
      for (std::size_t i = 0; i < 108; ++i)
        forward += y[i] * x[i], reverse += z[i] * b[i], size += std::abs(y[i] * x[i]);
      EXPECT_LT(std::abs(forward - reverse) / size, 1e-11);
    }
  }
}

/// The coefficient is `jump` inside, else 1; the aspect ratio of cells is `aspect`.
StencilMatrix with_jump(bool (*is_inside)(std::int64_t x, std::int64_t y), double jump, double aspect) {
  const Coefficient k = [=](std::int64_t cell, std::size_t axis) {
    const auto of = [&](std::int64_t x, std::int64_t y) { return is_inside(x, y) ? jump : 1.0; };
    const std::int64_t x = cell % 128, y = cell / 128;
    const double mean = (of(x, y) + (axis == 0 ? of(x + 1, y) : of(x, y + 1))) / 2;
    return axis == 1 ? aspect * aspect * mean : mean;
  };
  return diffusion({128, 128, 1}, {all_walls[1], all_walls[1], all_walls[0]}, 0, k);
}

/// In every other block of 8 x 8 cells.
bool is_in_block(std::int64_t x, std::int64_t y) { return (x / 8 + y / 8) % 2 == 1; }
bool is_in_disc(std::int64_t x, std::int64_t y) {
  return (2 * x - 127) * (2 * x - 127) + (2 * y - 127) * (2 * y - 127) < 64 * 64;
}
bool is_outside_disc(std::int64_t x, std::int64_t y) { return !is_in_disc(x, y); }

/// With linear interpolation around a disc cg takes 763 iterations (see solve/multigrid/multigrid_level.h).
TEST(LinearSolvers, ConjugateGradientsGoAroundDiscsOfOtherCoefficients) {
  for (const auto is_inside : {is_in_disc, is_outside_disc}) {
    for (const double jump : {1e3, 1e6}) {
      for (const double aspect : {1, 10, 100}) {
        const StencilMatrix matrix = with_jump(is_inside, jump, aspect);
        std::vector<double> b = arbitrary_values(matrix.size(), 9), x(b.size(), 0.0);
        const SolveReport report = LinearSolver(matrix, {.method = SolverMethod::cg, .tolerance = 1e-6}).solve(b, x);
        EXPECT_TRUE(report.converged);
        EXPECT_LE(report.iterations, 28) << jump << " " << aspect;
      }
    }
  }
}

/// The table in dsl-examples/manual/solves.md.
TEST(LinearSolvers, JumpsAndLongCellsTakeMoreIterations) {
  struct Case {
    double jump, aspect;
    int multigrid, cg;
  };
  for (const Case& c : {Case{1, 1, 8, 8}, Case{1, 10, 6, 7}, Case{1, 100, 5, 6}, Case{1e3, 1, 32, 17},
                        Case{1e3, 10, 390, 60}, Case{1e6, 1, 32, 17}}) {
    const StencilMatrix matrix = with_jump(is_in_block, c.jump, c.aspect);
    for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::cg}) {
      LinearSolver solver(matrix, {.method = method, .tolerance = 1e-6, .most_iterations = 1000});
      std::vector<double> b = arbitrary_values(matrix.size(), 9), x(b.size(), 0.0);
      const SolveReport report = solver.solve(b, x);
      EXPECT_TRUE(report.converged);
      EXPECT_LE(report.iterations, method == SolverMethod::cg ? c.cg : c.multigrid)
          << name_of(method) << " " << c.jump << " " << c.aspect;
    }
  }
}

TEST(LinearSolvers, MultigridNeedsFewCycles) {
  struct Case {
    GridCells cells;
    std::array<std::pair<Wall, Wall>, 3> walls;
    int most, most_alone;
  };
  const std::vector<Case> cases{{{128, 128, 1}, {all_walls[0], all_walls[0], all_walls[0]}, 8, 6},
                                {{128, 128, 1}, {all_walls[2], all_walls[2], all_walls[0]}, 9, 6},
                                {{128, 128, 1}, {all_walls[1], all_walls[1], all_walls[0]}, 9, 6},
                                {{512, 512, 1}, {all_walls[1], all_walls[0], all_walls[0]}, 9, 6},
                                {{100, 75, 1}, {all_walls[1], all_walls[3], all_walls[0]}, 12, 25},
                                {{64, 64, 64}, {all_walls[0], all_walls[0], all_walls[0]}, 10, 8},
                                {{32, 32, 32}, {all_walls[2], all_walls[1], all_walls[0]}, 10, 8}};
  for (const Case& c : cases) {
    for (const SolverMethod method : {SolverMethod::multigrid, SolverMethod::cg}) {
      const StencilMatrix matrix = diffusion(c.cells, c.walls, 0, constant_one);
      LinearSolver solver(matrix, {.method = method, .tolerance = 1e-6});
      std::vector<double> b = arbitrary_values(matrix.size(), 9), x(b.size(), 0.0);
      const SolveReport report = solver.solve(b, x);
      EXPECT_TRUE(report.converged);
      EXPECT_LE(report.iterations, method == SolverMethod::cg ? c.most : c.most_alone)
          << c.cells[0] << " x " << c.cells[1] << " x " << c.cells[2] << " " << name_of(method);
    }
  }
}

/// The table of smoothers in dsl-examples/manual/solves.md: cycles alone, and cg with them.
TEST(LinearSolvers, SmoothersNeedAsManyCyclesAsTheManualSays) {
  struct Case {
    GridCells cells;
    double along_y;
    std::array<int, 3> alone, with_cg;
  };
  const std::vector<Case> cases{{{128, 128, 1}, 1, {6, 7, 6}, {7, 6, 6}},
                                {{128, 128, 1}, 4, {14, 15, 9}, {10, 8, 7}},
                                {{128, 128, 1}, 100, {11, 5, 5}, {7, 6, 6}},
                                {{64, 64, 64}, 1, {7, 8, 7}, {8, 7, 6}}};
  constexpr std::array smoothers{SmootherKind::red_black, SmootherKind::jacobi, SmootherKind::chebyshev};
  for (const Case& c : cases) {
    const auto k = [&](std::int64_t, std::size_t axis) { return axis == 1 ? c.along_y : 1; };
    const StencilMatrix matrix = diffusion(c.cells, {all_walls[1], all_walls[1], all_walls[1]}, 0, k);
    const std::vector<double> b = arbitrary_values(matrix.size(), 9);
    for (std::size_t i = 0; i < 3; ++i) {
      for (const auto& [method, most] :
           {std::pair{SolverMethod::multigrid, c.alone[i]}, std::pair{SolverMethod::cg, c.with_cg[i]}}) {
        std::vector<double> x(b.size(), 0.0);
        const SolveOptions options{.method = method, .tolerance = 1e-6, .smoother = smoothers[i]};
        const SolveReport report = LinearSolver(matrix, options).solve(b, x);
        EXPECT_TRUE(report.converged && report.iterations <= most)
            << c.cells[2] << " " << c.along_y << " " << i << " " << name_of(method) << ": " << report.iterations;
      }
    }
  }
}

/// -lap(p) = f with p = cos(2 pi x) cos(pi y) between walls with zero slope in y: order 2.
TEST(LinearSolvers, ConvergeToTheExactSolution) {
  std::vector<double> errors;
  for (const std::int64_t n : {16, 32, 64}) {
    const StencilMatrix matrix = diffusion({n, n, 1}, {all_walls[0], all_walls[2], all_walls[0]}, 0, constant_one);
    std::vector<double> f, exact;
    for (std::int64_t j = 0; j < n; ++j) {
      for (std::int64_t i = 0; i < n; ++i) {
        const double x = (static_cast<double>(i) + 0.5) / static_cast<double>(n),
                     y = (static_cast<double>(j) + 0.5) / static_cast<double>(n), pi = std::numbers::pi;
        exact.push_back(std::cos(2 * pi * x) * std::cos(pi * y));
        f.push_back(5 * pi * pi * exact.back());
      }
    }
    std::vector<double> p(f.size(), 0.0);
    LinearSolver solver(matrix, {});
    EXPECT_EQ(solver.method(), SolverMethod::fourier);
    EXPECT_TRUE(solver.solve(f, p).converged);
    double error = 0;
    for (std::size_t i = 0; i < p.size(); ++i) error = std::max(error, std::abs(p[i] - exact[i]));
    errors.push_back(error);
  }
  EXPECT_NEAR(std::log2(errors[0] / errors[1]), 2, 0.02);
  EXPECT_NEAR(std::log2(errors[1] / errors[2]), 2, 0.02);
}

std::string message_of(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(LinearSolvers, SayWhatDoesNotFit) {
  const StencilMatrix walls = diffusion({8, 8, 1}, {all_walls[1], all_walls[1], all_walls[0]}, 0, uneven);
  const auto make = [](const StencilMatrix& matrix, SolverMethod method) {
    return message_of([&] { LinearSolver(matrix, {.method = method}); });
  };
  EXPECT_NE(make(walls, SolverMethod::fourier).find("not the same in all cells"), std::string::npos);
  EXPECT_NE(make(walls, SolverMethod::tridiagonal).find("one axis"), std::string::npos);
  StencilMatrix lopsided = walls;
  lopsided.values[1][20] *= 3;
  EXPECT_NE(make(lopsided, SolverMethod::cg).find("not symmetric"), std::string::npos);
  // Helmholtz operator with the wrong sign between the first waves: not cg or multigrid, but a direct method.
  const StencilMatrix indefinite = diffusion({8, 8, 1}, {all_walls[1], all_walls[1], all_walls[0]}, -35, constant_one);
  EXPECT_NE(make(indefinite, SolverMethod::multigrid), "");
  std::vector<double> b = arbitrary_values(64, 4), x(64, 0.0);
  EXPECT_TRUE(LinearSolver(indefinite, {.method = SolverMethod::cg}).solve(b, x).is_indefinite);
  EXPECT_TRUE(LinearSolver(indefinite, {.method = SolverMethod::direct}).solve(b, x).converged);
  EXPECT_LT(error_of(indefinite, b, x), 1e-10);
  const StencilMatrix fine = diffusion({64, 64, 1}, {all_walls[1], all_walls[1], all_walls[0]}, 0, uneven);
  b = arbitrary_values(64 * 64, 4), x.assign(64 * 64, 0.0);
  const SolveReport report = LinearSolver(fine, {.method = SolverMethod::cg, .most_iterations = 2}).solve(b, x);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.iterations, 2);
}

TEST(OperatorProbe, FindsTheMatrixAndRefusesWhatIsNotLinear) {
  const StencilMatrix matrix = diffusion({7, 5, 1}, {all_walls[0], all_walls[3], all_walls[0]}, 1, uneven);
  const LinearImage image = [&](std::span<const double> x, std::span<double> y) { multiply(matrix, x, y); };
  for (const std::int64_t reach : {1, 2, -1}) {
    const StencilMatrix found =
        OperatorProbe(matrix.cells, matrix.periodic, {reach, reach, 0}, 1e-16, "p").matrix(image);
    EXPECT_EQ(dense_of(found), dense_of(matrix)) << reach;
  }
  const auto refusal = [&](const LinearImage& f, std::int64_t reach) {
    return message_of([&] { OperatorProbe(matrix.cells, matrix.periodic, {reach, reach, 0}, 1e-16, "p").find(f); });
  };
  EXPECT_NE(refusal(image, 0).find("not linear"), std::string::npos);  // larger stencil radius
  const LinearImage bent = [&](std::span<const double> x, std::span<double> y) {
    multiply(matrix, x, y);
    for (double& value : y) value *= 1 + value * value;
  };
  EXPECT_NE(refusal(bent, 1).find("solve for p: the operator is not linear"), std::string::npos);
  const LinearImage shifted = [&](std::span<const double> x, std::span<double> y) {
    multiply(matrix, x, y);
    for (double& value : y) value += 1;
  };
  EXPECT_NE(refusal(shifted, 1).find("makes 1 of 0"), std::string::npos);
  // Only rounding, as differences in cells that obstacles fill: 1/3*3 - 1 is 0.
  const LinearImage nothing = [](std::span<const double> x, std::span<double> y) {
    for (std::size_t i = 0; i < x.size(); ++i) y[i] = x[i] / 3 * 3 - x[i];
  };
  EXPECT_EQ(refusal(nothing, 1), "");
  const LinearImage square = [](std::span<const double> x, std::span<double> y) {
    for (std::size_t i = 0; i < x.size(); ++i) y[i] = x[i] * x[i] - x[i];
  };
  EXPECT_NE(refusal(square, 1).find("not linear"), std::string::npos) << "nothing of a one and of a zero";
  const LinearImage cut_off = [](std::span<const double> x, std::span<double> y) {
    for (std::size_t i = 0; i < x.size(); ++i) y[i] = std::min(x[i], 2.0);
  };
  const std::vector<std::vector<double>> ones{std::vector<double>(35, 1.0)};
  EXPECT_EQ(OperatorProbe(matrix.cells, matrix.periodic, {1, 1, 0}, 1e-16, "p").matrix(cut_off).values, ones)
      << "no rounding";
  // Implicit steps near a turning point: terms cancel up to their rounding.
  const LinearImage cancelling = [](std::span<const double> x, std::span<double> y) {
    for (std::size_t i = 0; i < x.size(); ++i) y[i] = x[i] - (1 - 3e-4) * x[i];
  };
  EXPECT_EQ(refusal(cancelling, 1), "");
  const LinearImage bent_and_small = [&](std::span<const double> x, std::span<double> y) {
    for (std::size_t i = 0; i < x.size(); ++i) y[i] = 1e-20 * (x[i] + 1e-6 * x[i] * x[i]);
  };
  EXPECT_NE(refusal(bent_and_small, 1).find("not linear"), std::string::npos);
}

}  // namespace
}  // namespace dpde
