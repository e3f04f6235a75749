// SPDX-License-Identifier: Apache-2.0
// Solves determined by their smallest term: in div(c*grad(psi)) - k*psi the k, 1e-6 of the other terms in a diagonal,
// determines the mean of psi; advection as weak as that changes its shape. No flux passes any side, so the sums over
// all cells give the mean exactly: -mean(u)/k.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "../driver/driver_support.h"
#include "dpde/runtime/error.h"
#include "driver/scene/session.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde {
namespace {

using testing::run_scene;
using testing::task_gradient;

struct Equation {
  const char* terms;
  bool has_walls = false;
  bool is_symmetric = true, is_alike = true;  // is_alike: equal in all cells
  bool makes_decisions = false;
};

/// Cells of length 1/1024, as with 1024^2 cells in a box of length 1.
std::string scene_of(const Equation& equation, const std::string& real) {
  const std::string sides = equation.has_walls ? "" : ", periodic";
  return std::string("model m { field u; field p; coefficient c; param k; param v = 0.5; solve 0 = ") + equation.terms +
         " - k*psi - u for psi; dt(u) = 0; dt(p) = psi - p }\n" + "scheme s { time = euler; real = " + real + " }\n" +
         "scene a : m with s {\n" + "grid x = 0 .. 1/64, cells 16" + sides + "\ngrid y = 0 .. 1/64, cells 12" + sides +
         "\n" +
         (equation.has_walls ? "boundary u: all = zero_gradient\nboundary p: all = zero_gradient\n"
                               "boundary psi: all = zero_gradient\n"
                             : "") +
         "k = 1.5\nc = 1 + 0.3*sin(128*pi*x)*cos(128*pi*y)\n"
         "initial u = 1 + sin(128*pi*x)\ninitial p = 0\ntime 0 .. 1, step 1 }\n"
         "task t : a { unknown k from 1.5; minimise mean(p) }\n";
}

const std::vector<Equation> equations{
    {"lap(psi)"},
    {"lap(psi)", true},
    {"div(c*grad(psi))", false, true, false},
    {"div(c*grad(psi))", true, true, false},
    {"div(max(c, 0.9)*grad(psi))", false, true, false, true},
    {"lap(psi) + v*dx(psi)", false, false},
};
const char* const methods[] = {"automatic", "direct", "fourier", "multigrid", "cg", "bicgstab", "gmres"};

bool fits(const Equation& equation, const std::string& method) {
  if (method == "fourier") return equation.is_alike;
  return equation.is_symmetric || (method != "multigrid" && method != "cg");
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

TEST(SmallTerms, ATermWithoutDerivativesMakesTheMean) {
  for (const Equation& equation : equations) {
    for (const char* const real : {"f64", "f32"}) {
      const bool is_single = std::string(real) == "f32";
      for (const char* const method : methods) {
        if (!fits(equation, method) || (!is_single && std::string(method) != "automatic")) continue;
        for (const double k : {1.5, 0.01}) {
          if (k == 1.5 && !testing::is_thorough()) continue;
          const std::string what = std::string(equation.terms) + " " + real + " " + method + " " + std::to_string(k);
          const auto run = run_scene(scene_of(equation, real), "a", {{"solve", method}, {"k", std::to_string(k)}},
                                     driver::Backend::jit);
          const double of_diagonal = 0x1p-52 * 0x1p22 / k;  // the accuracy of k within a diagonal in f64
          EXPECT_NEAR(mean_of(run.state.at("p")), -1 / k, ((is_single ? 2e-5 : 1e-8) + 4 * of_diagonal) / k) << what;
        }
      }
    }
  }
}

/// d mean(psi)/dk = mean(u)/k^2, by the adjoint of the solve. For an unsymmetric operator this is a transposed solve,
/// available in f64 only.
TEST(SmallTerms, TheirGradientsAreThoseOfTheMean) {
  for (const Equation& equation : equations) {
    for (const char* const real : {"f64", "f32"}) {
      const bool is_single = std::string(real) == "f32";
      if (is_single && (!equation.is_symmetric || equation.makes_decisions)) continue;
      for (const char* const method : {"automatic", "gmres"}) {
        if (std::string(method) != "automatic" && (!is_single || !testing::is_thorough())) continue;
        const double slope = task_gradient(scene_of(equation, real), "t", {{"solve", method}}).gradient.at("k").at(0);
        EXPECT_NEAR(slope, 1 / 2.25, is_single ? 1e-5 : 1e-8) << equation.terms << " " << real << " " << method;
      }
    }
  }
}

/// In f32 a residual as large as the right-hand side may be the rounding of its rows and says nothing: iterations are
/// in f64.
TEST(SmallTerms, FewStepsAreNotTakenForRounding) {
  for (const char* const method : {"cg(1e-12, 1)", "multigrid(1e-12, 1)", "gmres(1e-12, 1)", "bicgstab(1e-12, 1)"}) {
    EXPECT_THROW(
        run_scene(scene_of(equations.front(), "f32"), "a", {{"solve", method}, {"k", "0.001"}}, driver::Backend::jit),
        Error)
        << method;
  }
}

/// Advection that changes matrix entries by 4e-6: over 1024 cells of length 1/1024 it changes the solution by 4e-3. On
/// a ring, the solution of psi'' + v*psi' - psi = -sin(2*pi*x)*(4*pi^2 + 1) + 2*pi*v*cos(2*pi*x) is sin(2*pi*x), with
/// eigenvalues of differences instead of derivatives.
TEST(SmallTerms, WeakAdvectionIsNoRounding) {
  const double h = 1.0 / 1024, turn = 2 * std::numbers::pi, v = 0.0078125;
  const double second = (2 - 2 * std::cos(turn * h)) / (h * h), first = std::sin(turn * h) / h;
  const std::string text = fmt::format(
      "model m {{ field u; field p; param v = {}; coefficient f\n"
      "  solve 0 = lap(psi) + v*dx(psi) - psi + f + 0*u for psi\n  dt(u) = 0; dt(p) = psi - p }}\n"
      "scheme s {{ time = euler; real = f32 }}\nscene g : m with s {{\n  grid x = 0 .. 1, cells 1024, periodic\n"
      "  f = {}*sin(2*pi*x) - {}*cos(2*pi*x)\n  initial u = 0\n  initial p = 0\n  time 0 .. 1, step 1\n}}\n",
      v, second + 1, v * first);
  for (const char* const method : {"automatic", "direct", "fourier", "bicgstab", "gmres"}) {
    const std::vector<double> found = run_scene(text, "g", {{"solve", method}}).state.at("p");
    for (std::size_t i = 0; i < found.size(); ++i) {
      const double x = (static_cast<double>(i) + 0.5) * h;
      ASSERT_NEAR(found[i], std::sin(turn * x), 2e-4) << method << " " << i;
    }
  }
}

}  // namespace
}  // namespace dpde
