// SPDX-License-Identifier: Apache-2.0
// Runs until steady: their end, and the gradient of the steady state by the implicit function theorem, against closed
// forms, the gradient through all steps, central differences and tangents.
#include <fmt/format.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "dpde/runtime/error.h"
#include "driver/scene/inverse.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// k*u'' = -f between walls of value 0: u = f*x*(1 - x)/(2*k), up to the error of the walls, f*h^2/(8*k).
std::string rod(int cells, const std::string& scheme, const std::string& time) {
  return fmt::format(R"(
model rod {{ field u; coefficient f; param k; dt(u) = k*lap(u) + f }}
scheme s {{ {} }}
scene line : rod with s {{
  grid x = 0 .. 1, cells {}
  k = 0.5
  f = 2
  boundary u = 0
  initial u = 0
  time {}
}}
task t : line {{ unknown k; unknown f; minimise mean(u) + mean(u^2) }}
)",
                     scheme, cells, time);
}

TEST(Steady, EndsAtTheClosedFormWithItsGradient) {
  struct Way {
    const char *scheme, *time;
  };
  for (const Way& way : {Way{"time = euler", "0 .. 100, step 1/400, until steady 1e-11"},
                         Way{"time = rk4", "0 .. 100, step 1/400, until steady 1e-11"},
                         Way{"time = ab3", "0 .. 100, step 1/2000, until steady 1e-11"},
                         Way{"time = backward_euler", "0 .. 100, step 1/2, until steady 1e-11"},
                         Way{"time = ars443", "0 .. 100, step 1/2, until steady 1e-11"}}) {
    for (const int cells : {1, 2, 3, 8}) {
      const std::string text = rod(cells, way.scheme, way.time);
      const std::vector<double> u = run_scene(text, "line").state.at("u");
      double first = 0, second = 0;
      for (int i = 0; i < cells; ++i) {
        const double h = 1.0 / cells, x = (i + 0.5) * h, exact = 2 * (x * (1 - x) + h * h / 4);
        EXPECT_NEAR(u[static_cast<std::size_t>(i)], exact, 1e-11) << way.scheme << " " << cells;
        first += exact / cells;
        second += exact * exact / cells;
      }
      // u is f/k times a field independent of both
      const TaskResult found = task_gradient(text, "t");
      const double by_size = first + 2 * second;
      EXPECT_NEAR(found.gradient.at("k").front(), -by_size / 0.5, 1e-10) << way.scheme << " " << cells;
      double by_f = 0;
      for (const double value : found.gradient.at("f")) by_f += value;
      EXPECT_NEAR(by_f, by_size / 2, 1e-10) << way.scheme << " " << cells;
    }
  }
}

/// A reaction, walls with a parameter, self-advection.
std::string front(const std::string& grid, const std::string& scheme, const std::string& until, int unknowns = 3,
                  const char* velocity = "0.3") {
  return fmt::format(R"(
model front {{ field u, v; param k, a, c
  dt(u) = -advect({}, u) + k*lap(u) + u - u^3 + c*v
  dt(v) = k*lap(v) - v + 0.5*u^2 }}
scheme s {{ {} }}
scene line : front with s {{
  {}
  k = 0.8
  a = 0.7
  c = 0.4
  boundary u: x.low = a, x.high = 0
  boundary v: x = zero_gradient
  initial u = 0.1
  initial v = 0
  time 0 .. 60, step 1/200{}
}}
task t : line {{ unknown k{}; minimise mean(u^2) + mean(u*v) }}
)",
                     velocity, scheme, grid, until, unknowns > 1 ? "; unknown a; unknown c" : "");
}

TEST(Steady, HasTheGradientThroughAllSteps) {
  for (const char* scheme : {"time = ssp_rk3", "time = ab2", "time = imex_euler", "advect = upwind(3); time = rk2"}) {
    const std::string grid = "grid x = 0 .. 2, cells 6";
    const TaskResult steady = task_gradient(front(grid, scheme, ", until steady 1e-12"), "t"),
                     all = task_gradient(front(grid, scheme, ""), "t");
    EXPECT_NEAR(steady.loss, all.loss, 1e-11) << scheme;
    for (const char* unknown : {"k", "a", "c"}) {
      EXPECT_NEAR(steady.gradient.at(unknown).front(), all.gradient.at(unknown).front(), 1e-10) << scheme << unknown;
    }
  }
}

/// Tangents of the steady state against its adjoint, the Taylor series and the Hessian.
TEST(Steady, IsCertifiedOnTinyGrids) {
  for (const int cells : {1, 2, 3, 5}) {
    const std::string grid = fmt::format("grid x = 0 .. 2, cells {}", cells);
    const auto certificate = certificate_of(front(grid, "time = rk2", ", until steady 1e-13"), true);
    ASSERT_TRUE(certificate);
    EXPECT_TRUE(certificate->passed()) << cells << certificate->note;
    EXPECT_LT(certificate->worst(), 1e-11) << cells;
    ASSERT_TRUE(certificate->second);
    EXPECT_TRUE(certificate->second->passed()) << cells;
  }
  const auto plane = certificate_of(front("grid x = 0 .. 2, cells 3\n  grid y = 0 .. 1, cells 2, periodic",
                                          "time = rk2", ", until steady 1e-13", 3, "(0.3, 0)"),
                                    false);
  ASSERT_TRUE(plane);
  EXPECT_TRUE(plane->passed());
}

/// The constraint holds after each step, and p is a state that no step reads.
std::string cavity(const std::string& scheme, const std::string& until) {
  return fmt::format(R"(
model convection {{
  vector u on faces
  field p
  field T
  param Ra, Pr
  dt(u) = -advect(u, u) - grad(p) + Pr*lap(u) + (0, Ra*Pr*interpolate(T))
  dt(T) = -advect(u, T) + lap(T)
  0 = div(u) gives p
}}
scheme s {{ {} }}
scene box : convection with s {{
  grid x = 0 .. 1, cells 6
  grid y = 0 .. 1, cells 5
  Ra = 2000
  Pr = 0.71
  initial u = 0
  initial T = 0.5 - x
  boundary u: all = 0
  boundary T: x.low = 0.5, x.high = -0.5, y = zero_gradient
  time 0 .. 8, step 1/400{}
}}
task t : box {{ unknown Ra; unknown Pr; minimise mean(interpolate(u.x)*T - dx(T)) }}
)",
                     scheme, until);
}

TEST(Steady, HasTheGradientOfAConstrainedFlow) {
  for (const char* scheme : {"time = rk2", "time = ars222"}) {
    const TaskResult steady = task_gradient(cavity(scheme, ", until steady 1e-9"), "t"),
                     all = task_gradient(cavity(scheme, ""), "t");
    for (const char* unknown : {"Ra", "Pr"}) {
      const double wanted = all.gradient.at(unknown).front();
      EXPECT_NEAR(steady.gradient.at(unknown).front(), wanted, 1e-8 * std::abs(wanted)) << scheme << unknown;
    }
    const auto loss_at = [&](const char* Ra) {
      return task_loss(cavity(scheme, ", until steady 1e-9"), "t", {{"Ra", Ra}});
    };
    const double slope = (8 * (loss_at("2010") - loss_at("1990")) - (loss_at("2020") - loss_at("1980"))) / 120;
    EXPECT_NEAR(steady.gradient.at("Ra").front(), slope, 1e-8 * std::abs(slope)) << scheme;
  }
}

TEST(Steady, SplitsItsStepsByACourantNumber) {
  const std::string courant = ", courant 0.1, speed 0.3", grid = "grid x = 0 .. 2, cells 6";
  const TaskResult steady = task_gradient(front(grid, "time = rk2", courant + ", until steady 1e-12", 1), "t"),
                   all = task_gradient(front(grid, "time = rk2", courant, 1), "t");
  EXPECT_NEAR(steady.gradient.at("k").front(), all.gradient.at("k").front(), 1e-10);
}

std::string error_of_task(const std::string& text) {
  try {
    task_gradient(text, "t");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Steady, SaysThatItIsNot) {
  const std::string said = error_of_task(rod(4, "time = euler", "0 .. 1, step 1/400, until steady 1e-11"));
  EXPECT_NE(said.find("after 400 steps (t = 1) the state is not steady: it changes by"), std::string::npos) << said;
}

/// In a closed box the final heat is the initial heat, which the gradient of the steady state would miss.
TEST(Steady, RefusesWhatDependsOnTheStart) {
  const std::string said = error_of_task(R"(
model rod { field u; param k, s; dt(u) = k*lap(u) + s*x }
scene line : rod {
  grid x = 0 .. 1, cells 4, periodic
  k = 1; s = 0
  initial u = x
  time 0 .. 10, step 1/100, until steady 1e-9
}
task t : line { unknown s; minimise mean(u^2) }
)");
  EXPECT_NE(said.find("the derivative of the steady state is not found"), std::string::npos) << said;
}

}  // namespace
}  // namespace dpde::testing
