// SPDX-License-Identifier: Apache-2.0
// Programs with solves against closed forms: implicit heat steps far beyond the explicit limit, and a Poisson equation.
// A wave sin(k x) of a grid is an eigenvector of the second difference with eigenvalue -(2 - 2 cos(k h))/h^2.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "../driver/driver_support.h"
#include "analysis/certificate/solve_tolerance.h"
#include "driver/scene/session.h"
#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::run_scene;
using testing::task_gradient;

const std::string heat_by_solves = R"(
kernel implicit(w: field halo 1, out image: field, nu, dt, hx: param) {
  image = w - dt*nu*(w[-1] - 2*w + w[+1])/hx^2
}
program ring_step { solve image = u for w { fill w periodic; run implicit }; swap u, w }
program rod_step { solve image = u for w { fill w x = 0; run implicit }; swap u, w }
loop n in 0 .. 10 { ring_step }
loop n in 0 .. 10 { rod_step }
scene ring : ring_step { grid x = 0 .. 1, cells 64, periodic; nu = 1; initial u = sin(2*pi*x); step 0.01 }
scene rod : rod_step { grid x = 0 .. 1, cells 64; nu = 1; initial u = sin(pi*x); step 0.01 }
task of_ring : ring { unknown nu from 1; minimise mean(u^2) }
task of_rod : rod { unknown nu from 1; minimise mean(u^2) }
)";

/// Amplitude of a wave after 10 steps, and its derivative by nu.
struct Amplitude {
  double value, slope;
};
Amplitude amplitude(double k, double cells) {
  const double lambda = (2 - 2 * std::cos(k / cells)) * cells * cells, factor = 1 + 0.01 * lambda;
  return {std::pow(factor, -10), -10 * 0.01 * lambda * std::pow(factor, -11)};
}

/// The step is 80 times the explicit limit.
TEST(ImplicitHeat, DampsWavesByTheClosedForm) {
  for (const auto backend : {driver::Backend::jit, driver::Backend::interpreter}) {
    for (const int cells : {1, 2, 3, 8, 64}) {
      const std::vector<double> ring =
          run_scene(heat_by_solves, "ring", {{"cells", std::to_string(cells)}}, backend).state.at("u");
      const std::vector<double> rod =
          run_scene(heat_by_solves, "rod", {{"cells", std::to_string(cells)}}, backend).state.at("u");
      for (int i = 0; i < cells; ++i) {
        const double x = (i + 0.5) / cells, pi = std::numbers::pi;
        EXPECT_NEAR(ring[static_cast<std::size_t>(i)], amplitude(2 * pi, cells).value * std::sin(2 * pi * x), 1e-13);
        EXPECT_NEAR(rod[static_cast<std::size_t>(i)], amplitude(pi, cells).value * std::sin(pi * x), 1e-13);
      }
    }
  }
}

TEST(ImplicitHeat, GradientByTheConductivityIsTheClosedForm) {
  const double pi = std::numbers::pi;
  for (const auto& [task, k] : {std::pair{"of_ring", 2 * pi}, std::pair{"of_rod", pi}}) {
    const Amplitude a = amplitude(k, 64);
    const auto result = task_gradient(heat_by_solves, task);
    EXPECT_NEAR(result.loss, a.value * a.value / 2, 1e-14) << task;
    EXPECT_NEAR(result.gradient.at("nu").front() / (a.value * a.slope), 1, 1e-11) << task;
  }
}

/// lap(p) = f, J = mean(p^2)/2: dJ/df = p/lambda in the mean over the cells; p has mean 0 for any mean of f.
const std::string poisson = R"(
kernel laplacian(p: field halo 1, out image: field, hx, hy: param) {
  image = (p[-1, 0] - 2*p + p[+1, 0])/hx^2 + (p[0, -1] - 2*p + p[0, +1])/hy^2
}
program solve_it {
  solve image = f for p { fill p periodic; run laplacian }
  swap f, p
}
loop n in 0 .. 1 { solve_it }
scene plane : solve_it {
  grid x = 0 .. 2*pi, cells 32, periodic
  grid y = 0 .. 2*pi, cells 24, periodic
  initial f = 5 + sin(x)*sin(y)
  step 1
}
task by_source : plane { unknown initial f; minimise 0.5*mean(f^2) }
)";

TEST(PoissonEquation, AndItsGradientAreTheClosedForm) {
  const double pi = std::numbers::pi;
  const auto eigenvalue = [&](double n) { return -(2 - 2 * std::cos(2 * pi / n)) * n * n / (4 * pi * pi); };
  const double lambda = eigenvalue(32) + eigenvalue(24);
  const std::vector<double> p = run_scene(poisson, "plane").state.at("f");
  const auto result = task_gradient(poisson, "by_source");
  const std::vector<double>& gradient = result.gradient.at("f");
  for (int j = 0; j < 24; ++j) {
    for (int i = 0; i < 32; ++i) {
      const double f = std::sin(2 * pi * (i + 0.5) / 32) * std::sin(2 * pi * (j + 0.5) / 24);
      const auto cell = static_cast<std::size_t>(i + 32 * j);
      EXPECT_NEAR(p[cell], f / lambda, 1e-13);
      EXPECT_NEAR(gradient[cell], f / (lambda * lambda * 32 * 24), 1e-15);
    }
  }
}

// ---- equations of models -------------------------------------------------------------------------------------------

/// psi is a multiple of omega, so advection vanishes and omega decays by the grid's own eigenvalue.
const std::string vortices = R"(
model flow {
  field omega
  param nu
  solve lap(psi) = -omega for psi
  let v = (dy(psi), -dx(psi))
  dt(omega) = -advect(v, omega) + nu*lap(omega)
}
scheme default { time = rk4 }
scene taylor_green : flow {
  grid x = 0 .. 2*pi, cells 16, periodic
  grid y = 0 .. 2*pi, cells 16, periodic
  nu = 0.01
  initial omega = 2*sin(x)*sin(y)
  exact   omega = 2*sin(x)*sin(y)*exp(-2*nu*t)
  time 0 .. 1, step 0.05
}
task by_viscosity : taylor_green { unknown nu; minimise 0.5*mean(psi*omega) }
)";

TEST(Vorticity, TaylorGreenVorticesDecayByTheClosedForm) {
  const double pi = std::numbers::pi;
  std::vector<double> errors;
  for (const int n : {16, 32, 64}) {
    const auto run = run_scene(vortices, "taylor_green", {{"cells", std::to_string(n)}});
    errors.push_back(run.l2.at("omega"));
    const double h = 2 * pi / n, decay = std::exp(-0.01 * 2 * (2 - 2 * std::cos(h)) / (h * h));
    const double at_first = 2 * std::pow(std::sin(h / 2), 2);
    EXPECT_NEAR(run.state.at("omega").front() / at_first, decay, 1e-10);
  }
  EXPECT_NEAR(std::log2(errors[0] / errors[1]), 2, 0.02);
  EXPECT_NEAR(std::log2(errors[1] / errors[2]), 2, 0.02);
}

/// The mean kinetic energy is exp(-4*nu*t)/4 (psi*omega/2), its derivative by nu -4*t times that; on a grid with lambda
/// instead of 2, where psi is omega/lambda.
TEST(Vorticity, GradientOfTheEnergyByTheViscosityIsTheClosedForm) {
  const double h = 2 * std::numbers::pi / 16, lambda = 2 * (2 - 2 * std::cos(h)) / (h * h);
  const double energy = std::exp(-2 * 0.01 * lambda) / (2 * lambda);
  const auto result = task_gradient(vortices, "by_viscosity");
  EXPECT_NEAR(result.loss / energy, 1, 1e-9);
  EXPECT_NEAR(result.gradient.at("nu").front() / (-2 * lambda * energy), 1, 1e-8);
}

/// u is p after one step of Euler: the solution between walls of all kinds, with values along them.
/// A coefficient with ghost cells filled for the solve is filled again after it. Found by a scene with two stages and a
/// wall value, which the verifier refused.
TEST(SolvedEquations, StagesFillCoefficientsAnew) {
  const std::string text = R"(
model m { field u; coefficient k; solve div(k*grad(psi)) = u for psi; dt(u) = psi }
scheme s { time = rk2 }
scene sc : m with s {
  grid x = 0 .. 1, cells 8
  k = 1 + x
  boundary u: all = zero_gradient
  boundary psi: all = 1
  initial u = x
  time 0 .. 0.1, step 0.05
}
task t : sc { unknown k; minimise mean(u^2) + mean(psi^2) }
)";
  const auto by = [&](const std::string& method) {
    return task_gradient(text, "t", {{"solve", method}}).gradient.at("k");
  };
  const std::vector<double> direct = by("direct"), cg = by("cg");
  ASSERT_EQ(direct.size(), 8u);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_NEAR(cg[i], direct[i], 1e-9);
  EXPECT_GT(std::abs(direct[3]), 1e-6);
}

/// Coefficients that jump by 1e6 between elongated cells: cg does not converge in 200 iterations.
TEST(SolvedEquations, OfJumpsFallBackOnFactors) {
  const std::string text = R"(
model m { field u; coefficient k; solve div(k*grad(psi)) = -1 for psi; dt(u) = psi - u }
scheme s { time = euler }
scene sc : m with s {
  grid x = 0 .. 1, cells 104
  grid y = 0 .. 1000, cells 104
  k = if(sin(50*x)*sin(0.05*y) > 0, 1, 1e6)
  boundary u: all = zero_gradient
  boundary psi: all = 0
  initial u = 0
  time 0 .. 1, step 1
}
)";
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  options.selection.name = "sc";
  const auto code = testing::compiled(source, options);
  ASSERT_TRUE(code);
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, code, {}, sink);
  ASSERT_TRUE(session);
  session->rollout().run();
  ASSERT_FALSE(session->rollout().solve_notes().empty());
  EXPECT_EQ(session->rollout().solve_notes().front().reason,
            "cg had not converged after 200 iterations: sparse factors");
  const std::vector<double> automatic = run_scene(text, "sc").state.at("u"),
                            direct = run_scene(text, "sc", {{"solve", "direct"}}).state.at("u");
  for (std::size_t i = 0; i < automatic.size(); ++i) EXPECT_NEAR(automatic[i], direct[i], 1e-9);
}

TEST(SolvedEquations, ConvergeBetweenWallsWithValuesAndSlopes) {
  // p = exp(x)*sin(2 y): div(k*grad(p)) with k = 1 + x/2 is k*(1 - 4)*p + p/2.
  const std::string text = R"(
model diffusion {
  field u
  coefficient k, f
  solve div(k*grad(p)) - 2*p = f for p
  dt(u) = p
}
scheme default { time = euler }
scene walls : diffusion {
  grid x = 0 .. 1, cells 8
  grid y = 0 .. 1, cells 8
  k = 1 + x/2
  f = (-3*(1 + x/2) + 0.5 - 2)*exp(x)*sin(2*y)
  boundary u: all = zero_gradient
  boundary p: x.low = sin(2*y), x.high = gradient(exp(1)*sin(2*y)),
    y.low = 0, y.high = mixed(1, 2, exp(x)*(sin(2) + 4*cos(2)))
  initial u = 0
  exact   u = exp(x)*sin(2*y)
  time 0 .. 1, step 1
}
)";
  for (const std::string method : {"direct", "cg"}) {
    std::vector<double> errors;
    for (const int n : {8, 16, 32, 64}) {
      const auto run = run_scene(text, "walls", {{"cells", std::to_string(n)}, {"solve", method}});
      errors.push_back(run.l2.at("u"));
    }
    for (std::size_t i = 1; i < errors.size(); ++i)
      EXPECT_NEAR(std::log2(errors[i - 1] / errors[i]), 2, 0.15) << method;
    EXPECT_LT(errors.back(), 1e-4);
  }
}

constexpr const char* tilted_bed = R"(
model m {
  field w
  coefficient k
  solve div(k*grad(psi)) = w for psi
  dt(w) = -dy(psi)*dx(w) + dx(psi)*dy(w)
}
scheme c { time = rk2; solve = cg(1e-4) }
scene s : m with c {
  grid x = 0 .. 1, cells 24
  grid y = 0 .. 1, cells 20
  boundary w: all = 0
  boundary psi: all = 0
  k = 1 + 0.5*sin(7*x)*cos(5*y)
  initial w = 10*sin(pi*x)*sin(2*pi*y)
  time 0 .. 0.2, step 1/50
}
task t : s {
  unknown initial w
  minimise mean(psi^2)
}
)";

std::vector<double> gradient_by(const std::string& solve, const std::string& guess) {
  return task_gradient(tilted_bed, "t", {{"solve", solve}, {"guess", guess}}).gradient.at("w");
}

double relative_error(const std::vector<double>& a, const std::vector<double>& b) {
  double squares = 0, size = 0;
  for (std::size_t i = 0; i < a.size(); ++i) squares += std::pow(a[i] - b.at(i), 2), size += b[i] * b[i];
  return std::sqrt(squares / size);
}

std::optional<analysis::ToleranceEffect> effect_by(const std::string& solve, const std::string& guess) {
  const SourceFile source("test.dpde", tilted_bed);
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  options.selection.name = "t";
  options.selection.overrides = {{"solve", solve}, {"guess", guess}};
  options.adjoint = true;
  return analysis::effect_of_tolerance(source, testing::compiled(source, options), {});
}

/// The error of a tolerance as reported by `dpde verify`, against sparse factorisations; also for solves from the last
/// solution.
TEST(SolveTolerance, LeavesWhatVerifySays) {
  for (const char* guess : {"none", "last"}) {
    const std::vector<double> exact = gradient_by("direct", guess);
    for (const char* solve : {"cg(1e-3)", "cg(1e-6)", "gmres(1e-5)", "multigrid(1e-4)"}) {
      const auto found = effect_by(solve, guess);
      ASSERT_TRUE(found);
      const double error = relative_error(gradient_by(solve, guess), exact);
      EXPECT_GT(error, 1e-10) << solve;
      EXPECT_NEAR(found->error, error, 0.01 * error) << solve << " " << guess;
      EXPECT_LE(error, found->bound) << solve << " " << guess;
      EXPECT_LE(found->bound, 1.2 * error) << solve << " " << guess;
      EXPECT_EQ(found->reference, 1e-13);
    }
  }
}

/// Near the smallest tolerance there is no reference for a measurement.
TEST(SolveTolerance, IsEstimatedWhereItIsSmall) {
  const auto found = effect_by("cg(1e-12)", "none");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->reference, 0);
  EXPECT_GT(found->error, 0);
  EXPECT_LT(found->error, 1e-10);
  const std::vector<double> exact = gradient_by("direct", "none");
  EXPECT_LE(relative_error(gradient_by("cg(1e-12)", "none"), exact), found->bound);
}

TEST(SolveTolerance, IsRoundingWithFactors) {
  const auto found = effect_by("direct", "none");
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->is_by_steps);
}

/// The operator of a solve contains another solve, on the same grid: u = w + q/10 with 4*q - q[-1] - q[+1] = w.
TEST(NestedSolves, KeepTheirRightSides) {
  const std::string text =
      "kernel outer(w: field halo 1, q: field, out image: field) on 1 axes { image = w + 0.1*q }\n"
      "kernel inner(q: field halo 1, out q_image: field) on 1 axes { q_image = 4*q - q[-1] - q[+1] }\n"
      "kernel take(w: field, out u_next: field) on 1 axes { u_next = w }\n"
      "program step {\n  axes x bounded\n  solve image = u for w {\n    solve q_image = w for q {\n"
      "      fill q x = 0\n      run inner\n    }\n    run outer\n  }\n  run take\n  swap u, u_next\n}\n"
      "scene line : step { grid x = 0 .. 1, cells 80; initial u = sin(3*x); time 0 .. 3, step 1 }\n";
  const std::vector<double> by_code = testing::run_scene(text, "line").state.at("u");
  const std::vector<double> expected = testing::run_scene(text, "line", {}, driver::Backend::interpreter).state.at("u");
  ASSERT_EQ(by_code.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(by_code[i], expected[i], 1e-11) << i;
}

}  // namespace
}  // namespace dpde
