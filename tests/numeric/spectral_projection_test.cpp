// SPDX-License-Identifier: Apache-2.0
// 0 = div(u) gives p for a velocity at the centres, with dx = spectral: solved mode by mode.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "../driver/driver_support.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

using std::numbers::pi;

std::string vortices(const std::string& often, const std::string& initial, const std::string& task = "") {
  return R"(
model flow {
  vector u
  field p
  param nu, rho
  dt(u) = -advect(u, u) - grad(p)/rho + nu*lap(u)
  0 = div(u) gives p )" +
         often + R"(
}
scheme waves { time = rk4; dx = spectral; lap = spectral; advect = spectral }
scene plane : flow with waves {
  grid x = 0 .. 2*pi, cells 8, periodic
  grid y = 0 .. 2*pi, cells 8, periodic
  nu = 0.1; rho = 2
  initial u = )" +
         initial + R"(
  time 0 .. 0.5, step 1/64
}
scene space : flow with waves {
  grid x = 0 .. 2*pi, cells 6, periodic
  grid y = 0 .. 2*pi, cells 4, periodic
  grid z = 0 .. 2*pi, cells 5, periodic
  nu = 0.1; rho = 2
  initial u = (sin(x)*cos(y) + 0.2*cos(z), cos(2*x) + 0.3*sin(z), sin(x) + cos(2*y)) projected
  time 0 .. 0.25, step 1/32
}
)" + task;
}
const std::string taylor_green = "(sin(x)*cos(y), -cos(x)*sin(y))";
/// With waves of two cells along x, along y and along both, which have zero slope.
const std::string short_waves = "(sin(x + y) + sin(4*x) + sin(y), cos(x) + sin(4*y)*cos(x) + sin(4*x)*sin(4*y))";

/// G. I. Taylor and A. E. Green 1937: u decays as exp(-2 nu t), p = rho/4*(cos(2x) + cos(2y))*exp(-4 nu t). The grid's
/// waves represent it exactly, so the whole error is in time.
TEST(SpectralProjection, TaylorGreenVorticesHaveTheErrorOfTimeAlone) {
  const auto error = [](const char* step) {
    const auto run = run_scene(vortices("", taylor_green), "plane", {{"step", step}});
    double largest = 0;
    for (std::size_t i = 0; i < 64; ++i) {
      const double x = 2 * pi * (static_cast<double>(i % 8) + 0.5) / 8;
      const double y = 2 * pi * (static_cast<double>(i / 8) + 0.5) / 8;
      const double u = std::sin(x) * std::cos(y) * std::exp(-2 * 0.1 * 0.5);
      largest = std::max(largest, std::abs(run.state.at("u.x")[i] - u));
    }
    return largest;
  };
  EXPECT_LT(error("1/64"), 1e-12);
  EXPECT_NEAR(std::log2(error("1/4") / error("1/8")), 4, 0.1);
}

TEST(SpectralProjection, PressureIsTheClosedForm) {
  const auto run = run_scene(vortices("", taylor_green), "plane", {{"step", "1/1024"}, {"end", "1/4"}});
  for (std::size_t i = 0; i < 64; ++i) {
    const double x = 2 * pi * (static_cast<double>(i % 8) + 0.5) / 8;
    const double y = 2 * pi * (static_cast<double>(i / 8) + 0.5) / 8;
    const double p = 0.5 * (std::cos(2 * x) + std::cos(2 * y)) * std::exp(-4 * 0.1 * 0.25);
    EXPECT_NEAR(run.state.at("p")[i], p, 2e-4) << "of the last stage, between steps";
  }
}

TEST(SpectralProjection, TakesTheDivergenceAwayOnAllGrids) {
  const std::string in_space = "task s : space { unknown nu; minimise mean(div(u)^2) }\n";
  for (const char* often : {"", "each step"}) {
    for (const char* cells : {"8, 8", "7, 8", "5, 3", "1, 4", "2, 2", "1, 1"}) {
      const std::string other = std::string("scene other = plane { cells ") + cells +
                                " }\ntask o : other { unknown nu; minimise mean(div(u)^2) }\n";
      EXPECT_LT(task_loss(vortices(often, short_waves, other), "o"), 1e-26) << often << " " << cells;
    }
    EXPECT_LT(task_loss(vortices(often, short_waves, in_space), "s"), 1e-26) << often;
  }
}

/// A divergence-free field is unchanged, including waves of two cells.
TEST(SpectralProjection, LeavesWhatIsFreeOfDivergence) {
  const std::string at_rest = R"(
model rest { vector u; field p; dt(u) = -grad(p); 0 = div(u) gives p }
scheme waves { time = rk4; dx = spectral }
scene plane : rest with waves {
  grid x = 0 .. 2*pi, cells 8, periodic
  grid y = 0 .. 2*pi, cells 8, periodic
  initial u = (sin(y) + sin(4*x), cos(x) + sin(4*x)*sin(4*y))
  time 0 .. 1, step 1/4
}
)";
  const auto state = run_scene(at_rest, "plane").state;
  for (std::size_t i = 0; i < 64; ++i) {
    const double x = 2 * pi * (static_cast<double>(i % 8) + 0.5) / 8;
    const double y = 2 * pi * (static_cast<double>(i / 8) + 0.5) / 8;
    EXPECT_NEAR(state.at("u.x")[i], std::sin(y) + std::sin(4 * x), 1e-13);
    EXPECT_NEAR(state.at("u.y")[i], std::cos(x) + std::sin(4 * x) * std::sin(4 * y), 1e-13);
  }
}

TEST(SpectralProjection, IsTheSameInTheInterpreter) {
  for (const char* scene : {"plane", "space"}) {
    const Overrides few{{"end", "1/16"}};
    const auto machine = run_scene(vortices("each step", short_waves), scene, few).state,
               other = run_scene(vortices("each step", short_waves), scene, few, driver::Backend::interpreter).state;
    for (const char* name : {"u.x", "u.y", "p"}) {
      for (std::size_t i = 0; i < machine.at(name).size(); ++i)
        EXPECT_NEAR(machine.at(name)[i], other.at(name)[i], 1e-12) << scene << name << i;
    }
  }
}

TEST(SpectralProjection, HasExactDerivatives) {
  for (const char* often : {"each stage", "each step"}) {
    for (const char* cells : {"4, 3", "1, 2"}) {
      expect_certified(vortices(often, short_waves + " projected",
                                std::string("scene few = plane { cells ") + cells +
                                    "; time 0 .. 1/8, step 1/32 }\ntask t : few { unknown rho; unknown nu\n"
                                    "  minimise mean(u.x^2*u.y) over time; minimise 0.1*mean(p^2) }\n"),
                       true);
      if (!is_thorough()) break;
    }
  }
}

}  // namespace
}  // namespace dpde::testing
