// SPDX-License-Identifier: Apache-2.0
// dt(u) + c*du/dn = 0: reflection at a side where a wave leaves, orders against the closed form, energy, gradients,
// back ends.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "../driver/driver_support.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// A central hump splits into two waves that leave at both ends. `speed`: the boundary condition.
std::string leaving(const std::string& scheme, const std::string& speed = "radiating(c)") {
  return "model string { field u; param c; dt(dt(u)) = c^2*lap(u) }\nscheme s { " + scheme +
         " }\n"
         "scene out : string with s {\n"
         "  grid x = 0 .. 1, cells 64\n"
         "  c = 1\n"
         "  boundary u: x = " +
         speed +
         "\n"
         "  initial u = exp(-((x - 0.5)/0.06)^2)\n"
         "  initial dt(u) = 0\n"
         "  exact u = (exp(-((x - 0.5 - c*t)/0.06)^2) + exp(-((x - 0.5 + c*t)/0.06)^2))/2\n"
         "  time 0 .. 1, step 1/2048\n"
         "}\n";
}

double error(const std::string& text, int cells, const std::string& end) {
  return run_scene(text, "out", {{"cells", std::to_string(cells)}, {"end", end}}).l2.at("u");
}

TEST(Radiating, WhatLeavesIsOfOrderTwo) {
  for (const char* time : {"rk4", "verlet", "ab3"}) {
    const std::string text = leaving(std::string("time = ") + time);
    for (const char* end : {"0.5", "1"}) {  // half of it has left; all of it
      const double order = std::log2(error(text, 128, end) / error(text, 256, end));
      EXPECT_NEAR(order, 2, 0.15) << time << " " << end;
    }
  }
  EXPECT_NEAR(std::log2(error(leaving("lap = central(4)"), 256, "1") / error(leaving("lap = central(4)"), 512, "1")), 2,
              0.3);
}

/// Reflection coefficient at normal incidence if the condition has another speed c': (c - c')/(c + c') (Engquist and
/// Majda 1977). 1 for a wall with zero slope, 1/3 for half the speed.
TEST(Radiating, ReflectionIsThatOfTheSpeed) {
  const auto left = [](const std::string& side) { return error(leaving("time = rk4", side), 512, "1"); };
  const double wall = left("zero_gradient");
  EXPECT_LT(left("radiating(c)") / wall, 2e-3);
  EXPECT_NEAR(left("radiating(c/2)") / wall, 1.0 / 3, 3e-3);
  EXPECT_NEAR(left("radiating(3*c)") / wall, 0.5, 5e-3);
}

/// h*sum(v^2 + (c*du/dx)^2), with half weights in the end cells, decreases by c*(v^2 at both ends): nothing grows, for
/// any number of cells, also if the speed at the end differs from the wave's.
TEST(Radiating, NothingGrows) {
  for (const char* side : {"radiating(c)", "radiating(c/5)", "radiating(4*c)"}) {
    for (const char* cells : {"1", "2", "3", "8", "33"}) {
      const auto state = run_scene(leaving("time = rk4", side), "out", {{"cells", cells}, {"end", "8"}}).state;
      for (const double v : state.at("u_t")) EXPECT_LT(std::abs(v), 1) << side << " " << cells;
    }
  }
}

/// Sound as two equations of first order, in right- and left-going parts, v + p and v - p over Z: at each end the
/// incoming part is 0.
TEST(Characteristic, WhatLeavesIsOfOrderTwo) {
  const std::string text =
      "model sound { field p, v; param Z; dt(p) = -Z*dx(v); dt(v) = -dx(p)/Z }\nscheme s { time = rk4 }\n"
      "scene out : sound with s {\n  grid x = 0 .. 1, cells 64\n  Z = 2\n"
      "  boundary p: x.low = -Z*v, x.high = Z*v\n  boundary v: x = linear\n"
      "  initial p = exp(-((x - 0.5)/0.06)^2)\n  initial v = 0\n"
      "  exact p = (exp(-((x - 0.5 - t)/0.06)^2) + exp(-((x - 0.5 + t)/0.06)^2))/2\n"
      "  time 0 .. 1, step 1/2048\n}\n"
      "task t : out { unknown Z; unknown initial p; minimise mean(p^2 + v^2) over time }\n";
  const auto error_of_p = [&](int cells, const char* end) {
    return run_scene(text, "out", {{"cells", std::to_string(cells)}, {"end", end}}).l2.at("p");
  };
  EXPECT_NEAR(std::log2(error_of_p(128, "0.5") / error_of_p(256, "0.5")), 2, 0.15);  // half of it has left
  const double left = error_of_p(256, "1"), pulse = std::sqrt(0.06 * std::sqrt(std::acos(-1) / 2));
  EXPECT_GT(std::log2(error_of_p(128, "1") / left), 1.9);
  EXPECT_LT(left / pulse, 3e-4);
  const auto certificate = certificate_of(std::string(text).replace(text.find("cells 64"), 8, "cells 5"), true);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->passed());
}

/// An unknown speed that varies in space, together with other conditions, in two dimensions.
std::string sought(const std::string& time, const std::string& cells_x, const std::string& cells_y) {
  return "model sound { field p; coefficient c2; param a, g; dt(dt(p)) = c2*lap(p) }\n"
         "scheme s { lap = central(4); time = " +
         time +
         " }\n"
         "scene out : sound with s {\n"
         "  grid x = 0 .. 1, cells " +
         cells_x + "\n  grid y = 0 .. 1, cells " + cells_y +
         "\n  a = 0.8\n  g = 0.3\n  c2 = 0.4 + 0.2*x*y\n"
         "  boundary p: x.low = radiating(sqrt(c2)), x.high = radiating(a*(1 + y*t)), y.low = gradient(g), "
         "y.high = radiating(a)\n"
         "  initial p = sin(3*x)*cos(2*y)\n  initial dt(p) = x - y^2\n  time 0 .. 0.1, step 0.01\n}\n"
         "task t : out {\n  unknown initial p\n  unknown initial dt(p)\n  unknown c2\n  unknown a from 0.8\n"
         "  unknown g from 0.3\n"
         "  minimise integral((p - 0.1)^2) + mean(lap(p)^2) over time\n}\n";
}

TEST(Radiating, DerivativesAreCertified) {
  for (std::size_t count = 0; const char* time : {"rk4", "verlet", "ab2", "ssp_rk3"}) {
    for (const char* cells : {"1", "2", "3", "7"}) {
      if (!testing::is_tried(count++, 3)) continue;
      const auto certificate = certificate_of(sought(time, cells, "4"), true);
      ASSERT_TRUE(certificate);
      EXPECT_TRUE(certificate->passed()) << time << " " << cells;
      EXPECT_LT(certificate->worst(), 1e-11) << time << " " << cells;
    }
  }
}

TEST(Radiating, BackEndsAgree) {
  const std::string text = sought("rk4", "6", "5");
  const auto jit = run_scene(text, "out").state;
  const auto oracle = run_scene(text, "out", {}, driver::Backend::interpreter).state;
  const auto cpp = run_scene(text, "out", {}, driver::Backend::cpp).state;
  for (const auto& [name, values] : cpp) {
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(jit.at(name)[i], values[i], 1e-14) << name;
  }
  for (const auto& [name, values] : oracle) {
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(jit.at(name)[i], values[i], 1e-12) << name;
  }
}

}  // namespace
}  // namespace dpde::testing
