// SPDX-License-Identifier: Apache-2.0
// Boundary values and slopes that are formulas of fields: orders against closed forms, gradients, back ends.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "../driver/driver_support.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

double order_at_walls(const std::string& text, const std::string& scene, const std::string& field, int cells) {
  const auto error = [&](int n) { return run_scene(text, scene, {{"cells", std::to_string(n)}}).l2.at(field); };
  return std::log2(error(cells) / error(2 * cells));
}

/// A plate that radiates at x.high and loses heat by its own law at x.low; `g`, `f` are the source terms that make a
/// decaying wave the solution.
std::string plate_of_formula(const std::string& time, const std::string& lap = "central(2)") {
  return "model plate { field T; param k, w; dt(T) = k*lap(T) }\nscheme s { time = " + time + "; lap = " + lap +
         " }\n"
         "function wave(x, t, k, w) = 1 + 0.5*cos(w*x + 0.3)*exp(-k*w^2*t)\n"
         "function slope(x, t, k, w) = -0.5*w*sin(w*x + 0.3)*exp(-k*w^2*t)\n"
         "scene hot : plate with s {\n  grid x = 0 .. 1, cells 16\n  k = 0.1\n  w = 2\n"
         "  boundary T: x.high = gradient(wave(1, t, k, w)^4 + slope(1, t, k, w) - T^4),\n"
         "              x.low = gradient(sin(T) - sin(wave(0, t, k, w)) - slope(0, t, k, w))\n"
         "  initial T = wave(x, 0, k, w)\n  exact T = wave(x, t, k, w)\n  time 0 .. 0.5, step 1/8192\n}\n";
}

TEST(WallFormulas, SlopesAreOfOrderTwo) {
  for (const char* time : {"rk4", "ssp_rk3", "ab2"})
    EXPECT_NEAR(order_at_walls(plate_of_formula(time), "hot", "T", 16), 2, 0.1) << time;
  EXPECT_NEAR(order_at_walls(plate_of_formula("rk4", "central(4)"), "hot", "T", 32), 2, 0.35);
}

/// gradient(-2*u) equals mixed(2, 1, 0), and x.low = v the value of v, with errors of order 2.
TEST(WallFormulas, AreTheConditionsThatTheyStandFor) {
  const auto text = [](const std::string& sides) {
    return "model m { field u, v; dt(u) = 0.1*lap(u); dt(v) = 0.1*lap(v) }\nscheme s { time = rk4 }\n"
           "scene a : m with s {\n  grid x = 0 .. 1, cells 16\n  boundary u: " +
           sides +
           "\n  boundary v: x.low = t, x.high = mixed(2, 1, 0)\n  initial u = sin(x)*(1 - x)^2\n"
           "  initial v = sin(x)*(1 - x)^2\n  time 0 .. 0.5, step 1/4096\n}\n";
  };
  const auto difference = [&](const std::string& sides, int cells) {
    const auto state = run_scene(text(sides), "a", {{"cells", std::to_string(cells)}}).state;
    double largest = 0;
    for (std::size_t i = 0; i < state.at("u").size(); ++i)
      largest = std::max(largest, std::abs(state.at("u")[i] - state.at("v")[i]));
    return largest;
  };
  for (const char* sides : {"x.low = t, x.high = gradient(-2*u)", "x.low = v, x.high = gradient(-2*v)",
                            "x.low = 2*v - u, x.high = mixed(1, 1, -u)"}) {
    const double coarse = difference(sides, 16), fine = difference(sides, 32);
    EXPECT_LT(coarse, 0.02) << sides;
    EXPECT_NEAR(std::log2(coarse / fine), 2, 0.3) << sides;
  }
}

/// Inflow has the value 1, outflow the arriving value, in a wind that reverses.
TEST(WallFormulas, InflowAndOutflowByTheSignOfTheVelocity) {
  const std::string text = R"(
model carried { field q; field v; dt(q) = -advect(v, q); dt(v) = -0.6*pi*sin(2*pi*t) }
scheme s { advect = upwind(1); time = ssp_rk3 }
scene tube : carried with s {
  grid x = 0 .. 1, cells 100
  boundary q: x.low = if(v > 0, 1, q), x.high = if(v < 0, 2, q)
  boundary v = zero_gradient
  initial q = 0
  initial v = 0.3
  time 0 .. 0.25, step 1/1000
}
scene back = tube { time 0 .. 0.75, step 1/1000 }
)";
  const auto forth = run_scene(text, "tube").state.at("q"), back = run_scene(text, "back").state.at("q");
  EXPECT_NEAR(forth.front(), 1, 0.05);  // it entered over 0.3/(2 pi)
  EXPECT_NEAR(forth[50], 0, 1e-6);
  EXPECT_NEAR(forth.back(), 0, 1e-12);
  EXPECT_LT(back.front(), 0.2);  // gone again except for upwind diffusion
  EXPECT_NEAR(back.back(), 2, 0.05);
  for (const double q : back) EXPECT_TRUE(q > -1e-9 && q < 2 + 1e-9) << q;
}

/// Two substances that react on a wall; flow on faces that leaves at one end; everything is unknown.
std::string reacting_at_walls(const std::string& time, const std::string& cells_x, const std::string& cells_y) {
  return fmt::format(R"(
model m {{ field a, b; vector u on faces; coefficient c; param k, D
  dt(a) = D*lap(a) - interpolate(u.x)*dx(a)
  dt(b) = D*lap(b) + 0.1*dy(a)
  dt(u) = 0.01*lap(u) }}
scheme s {{ time = {}; dx = central(4) }}
scene film : m with s {{
  grid x = 0 .. 1, cells {}
  grid y = 0 .. 1, cells {}
  k = 0.7
  D = 0.05
  c = 1 + 0.3*y + 0.2*x
  boundary a: x.low = gradient(-k*c*a*b), x.high = if(u.x > 0, a, 0.2), y = mixed(1, 0.5, b^2)
  boundary b: x = gradient(k*c*a*b), y.low = zero_gradient, y.high = sin(a)
  boundary u.x: x.low = 0.3, x.high = outflow, y = 0
  boundary u.y: x = zero_gradient, y = 0
  initial a = 1 + 0.3*sin(3*x + 1)*cos(2*y)
  initial b = 0.5 + 0.2*x*y
  initial u = (0.3 + 0.1*x*y, 0)
  time 0 .. 0.04, step 0.01
}}
task t : film {{
  unknown k from 0.7
  unknown c
  unknown initial a
  unknown initial b
  minimise mean((a - 0.4)^2 + b^2) + integral(k*a*b, at = x.low) + mean(lap(a)^2)
}}
)",
                     time, cells_x, cells_y);
}

TEST(WallFormulas, DerivativesAreCertified) {
  for (std::size_t count = 0; const char* time : {"rk4", "ab2", "ssp_rk3"}) {
    for (const char* cells : {"1", "2", "5"}) {
      if (!testing::is_tried(count++, 2)) continue;
      const auto certificate = certificate_of(reacting_at_walls(time, cells, "5"), std::string(time) == "rk4");
      ASSERT_TRUE(certificate);
      EXPECT_TRUE(certificate->passed()) << time << " " << cells;
      EXPECT_LT(certificate->worst(), 1e-11) << time << " " << cells;
    }
  }
}

/// A damped string whose ends are held by springs that stiffen.
TEST(WallFormulas, OfWavesAreCertified) {
  const std::string text =
      "model string { field u; param k; dt(dt(u)) = lap(u) }\nscheme s { time = TIME }\nscene held : string with s {\n"
      "  grid x = 0 .. 1, cells 7\n  k = 2\n  boundary u: x.low = gradient(-k*u^3 - dt(u)/2), x.high = gradient(-k*u)\n"
      "  initial u = 0.3 + x\n  initial dt(u) = x^2\n  time 0 .. 0.1, step 0.01\n}\n"
      "task t : held { unknown k; unknown initial u; unknown initial dt(u); minimise mean(u^2 + dt(u)) }\n";
  for (const std::string time : {"verlet", "rk4"}) {
    const auto certificate =
        certificate_of(text.substr(0, text.find("TIME")) + time + text.substr(text.find("TIME") + 4), true);
    ASSERT_TRUE(certificate);
    EXPECT_TRUE(certificate->passed()) << time;
    EXPECT_LT(certificate->worst(), 1e-11) << time;
  }
}

TEST(WallFormulas, BackEndsAgree) {
  const std::string text = reacting_at_walls("rk4", "6", "5");
  const auto jit = run_scene(text, "film").state;
  const auto oracle = run_scene(text, "film", {}, driver::Backend::interpreter).state;
  const auto cpp = run_scene(text, "film", {}, driver::Backend::cpp).state;
  for (const auto& [name, values] : oracle) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      EXPECT_NEAR(jit.at(name)[i], values[i], 1e-12) << name;
      EXPECT_NEAR(cpp.at(name)[i], values[i], 1e-12) << name;
    }
  }
}

}  // namespace
}  // namespace dpde::testing
