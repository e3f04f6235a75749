// SPDX-License-Identifier: Apache-2.0
// Semi-Lagrangian transport, MacCormack and cubic: orders against closed forms, also between walls, and bounds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::Overrides;
using testing::run_scene;

/// The order between the last two of three runs, each with twice the cells and half the step of the one before; the
/// first step is pi/parts.
double observed_order(const std::string& text, const std::string& scene, int cells, int parts, Overrides overrides) {
  double error = 0, order = 0;
  for (int level = 0; level < 3; ++level) {
    overrides["cells"] = std::to_string(cells << level);
    overrides["step"] = "pi/" + std::to_string(parts << level);
    const double before = error;
    error = run_scene(text, scene, overrides).l2.at("u");
    order = std::log2(before / error);
  }
  EXPECT_GT(error, 1e-10) << scene;
  EXPECT_LT(error, 1e-2) << scene;
  return order;
}

const Overrides maccormack{{"advect", "maccormack"}}, linear{{"advect", "semi_lagrangian"}};

/// A front without an extremum, which the clamp would cut: advected at constant velocity, at one that varies in time,
/// and by itself.
const std::string fronts = R"(
model wind { field u; param c; dt(u) = -advect(c, u) }
model gusts { field u; dt(u) = -advect(1 + cos(3*t), u) }
model itself { field u; dt(u) = -advect(u, u) }
scene steady : wind {
  grid x = -2*pi .. 2*pi, cells 64
  boundary u: x.low = 0, x.high = 1
  c = 1
  initial u = 0.5 + 0.5*tanh(2*x)
  exact u = 0.5 + 0.5*tanh(2*(x - t))
  time 0 .. pi, step pi/32
}
scene unsteady : gusts {
  grid x = -2*pi .. 2*pi, cells 64
  boundary u: x.low = 0, x.high = 1
  initial u = 0.5 + 0.5*tanh(2*x)
  exact u = 0.5 + 0.5*tanh(2*(x - t - sin(3*t)/3))
  time 0 .. pi/2, step pi/32
}
scene spreading : itself {
  grid x = -1 .. 1, cells 64
  boundary u: x = x/(1 + t)
  initial u = x
  exact u = x/(1 + t)
  time 0 .. pi/2, step pi/32
}
)";

TEST(MacCormack, IsOfOrderTwo) {
  EXPECT_NEAR(observed_order(fronts, "steady", 64, 32, maccormack), 2, 0.15);    // Courant number 0.5
  EXPECT_NEAR(observed_order(fronts, "steady", 80, 8, maccormack), 2, 0.15);     // 2.5
  EXPECT_NEAR(observed_order(fronts, "unsteady", 64, 32, maccormack), 2, 0.15);  // up to 1
  EXPECT_NEAR(observed_order(fronts, "spreading", 40, 32, maccormack), 2, 0.15);
  EXPECT_NEAR(observed_order(fronts, "spreading", 40, 32, linear), 1, 0.15);
}

/// v = sin(pi x) vanishes at both walls; along its characteristics tan(pi x/2) grows as exp(pi t).
const std::string between_walls = R"(
function origin(x, t) = 2/pi*atan(tan(pi*x/2)*exp(-pi*t))
model slow { field u; dt(u) = -advect(sin(pi*x), u) }
model along { field u; dt(u) = -advect((1, sin(pi*y)), u) }
scene even : slow {
  grid x = 0 .. 1, cells 20
  boundary u: x = zero_gradient
  initial u = cos(pi*x)
  exact u = cos(pi*origin(x, t))
  time 0 .. pi/8, step pi/64
}
scene odd : slow {
  grid x = 0 .. 1, cells 20
  boundary u: x = 0
  initial u = sin(pi*x)
  exact u = sin(pi*origin(x, t))
  time 0 .. pi/8, step pi/64
}
scene stretched : slow {
  grid x = 0 .. 1, cells 20, stretched (exp(x) - 1)/(exp(1) - 1)
  boundary u: x = 0
  initial u = sin(pi*x)
  exact u = sin(pi*origin(x, t))
  time 0 .. pi/8, step pi/64
}
scene channel : along {
  grid x = 0 .. 2*pi, cells 20, periodic
  grid y = 0 .. 1, cells 20
  boundary u: y.low = 0, y.high = 0
  initial u = sin(x)*sin(pi*y)
  exact u = sin(x - t)*sin(pi*origin(y, t))
  time 0 .. pi/8, step pi/64
}
)";

TEST(MacCormack, IsOfOrderTwoBetweenWalls) {
  EXPECT_NEAR(observed_order(between_walls, "even", 40, 64, maccormack), 2, 0.15);
  EXPECT_NEAR(observed_order(between_walls, "odd", 80, 128, maccormack), 2, 0.15);
  EXPECT_NEAR(observed_order(between_walls, "even", 40, 64, linear), 1, 0.15);
}

/// With short steps only the interpolation error matters.
TEST(CubicSemiLagrangian, InterpolatesToOrderThreeUpToWalls) {
  for (const char* scene : {"even", "odd", "channel"}) {
    const auto error = [&](const char* cells) {
      return run_scene(between_walls, scene,
                       {{"advect", "semi_lagrangian(cubic)"}, {"cells", cells}, {"step", "pi/8192"}})
          .l2.at("u");
    };
    EXPECT_NEAR(std::log2(error("16") / error("32")), 3, 0.3) << scene;
  }
}

/// LeVeque's reversal: a bump in a swirl that reverses returns to its start; and one in a swirl that keeps turning.
const std::string swirls = R"(
function bump(x, y) = exp(-30*((x - 0.5)^2 + (y - 0.72)^2))
model reversal { field u; dt(u) = -advect((sin(pi*x)^2*sin(2*pi*y)*cos(2*t), -sin(pi*y)^2*sin(2*pi*x)*cos(2*t)), u) }
model rotation { field u; dt(u) = -advect((0.5 - y, x - 0.5), u) }
scene there_and_back : reversal {
  grid x = 0 .. 1, cells 32, periodic
  grid y = 0 .. 1, cells 32, periodic
  initial u = bump(x, y)
  exact u = bump(x, y)
  time 0 .. pi/2, step pi/32
}
scene around : rotation {
  grid x = -1 .. 2, cells 64
  grid y = -1 .. 2, cells 64
  boundary u: x = 0, y = 0
  initial u = bump(x, y)
  exact u = bump(0.5 + (x - 0.5)*cos(t) + (y - 0.5)*sin(t), 0.5 - (x - 0.5)*sin(t) + (y - 0.5)*cos(t))
  time 0 .. pi/2, step pi/32
}
)";

TEST(CubicSemiLagrangian, FollowsVelocitiesThatVaryToOrderTwo) {
  const Overrides cubic{{"advect", "semi_lagrangian(cubic)"}};
  EXPECT_GT(observed_order(swirls, "there_and_back", 32, 32, cubic), 1.9);  // 2.87; x - dt*v(x) alone gives 0.87
  EXPECT_GT(observed_order(swirls, "around", 48, 32, cubic), 1.9);
  EXPECT_GT(observed_order(between_walls, "stretched", 20, 64, cubic), 1.9);
  EXPECT_GT(observed_order(between_walls, "even", 20, 64, cubic), 1.9);
  EXPECT_GT(observed_order(between_walls, "odd", 20, 64, cubic), 1.9);
  // The last cells have the wall's value at the end of the step.
  EXPECT_GT(observed_order(fronts, "spreading", 40, 32, cubic), 1.5);
}

/// Departure points that depend on the state and on a parameter, periodic and between walls.
TEST(CubicSemiLagrangian, DerivativesOfDeparturePointsAreExact) {
  for (const std::string& axis :
       {std::string(", periodic"),
        std::string(
            "\n  boundary u: x.low = 0.3, x.high = zero_gradient\n  boundary c: x.low = zero_gradient, x.high = b")}) {
    const std::string text =
        "model m { field u, c; param b; dt(u) = -advect(u*(1 + b*sin(3*t)), u); dt(c) = -advect(u + b, c) + 0.1*c }\n"
        "scheme s { advect = semi_lagrangian(cubic); time = rk2 }\nscene s : m with s {\n  grid x = 0 .. 1, cells 12" +
        axis +
        "\n  b = 0.2\n  initial u = 0.4 + 0.3*sin(2*pi*x)\n  initial c = cos(2*pi*x)\n  time 0 .. 0.4, step 0.1\n}\n"
        "task t : s { unknown initial u; unknown initial c; unknown b; minimise mean(c^2*u) + mean(u^3) }\n";
    testing::expect_certified(text, false);
  }
}

TEST(MacCormack, IsOfOrderTwoOnThreeAxes) {
  const std::string text = R"(
model carry { field u; dt(u) = -advect((1, -0.7, 0.4), u) }
scene box : carry {
  grid x = 0 .. 2*pi, cells 12, periodic
  grid y = 0 .. 2*pi, cells 12, periodic
  grid z = 0 .. 2*pi, cells 12, periodic
  initial u = sin(x)*cos(y) + sin(z)
  exact u = sin(x - t)*cos(y + 0.7*t) + sin(z - 0.4*t)
  time 0 .. pi/2, step pi/20
}
)";
  EXPECT_NEAR(observed_order(text, "box", 12, 10, maccormack), 2, 0.15);
}

const std::string hats = R"(
model wind { field u; dt(u) = -advect(1, u) }
model stir { field u; dt(u) = -advect((sin(pi*x)^2*sin(2*pi*y), -sin(pi*y)^2*sin(2*pi*x)), u) }
scene ring : wind {
  grid x = 0 .. 1, cells 50, periodic
  initial u = if(abs(x - 0.5) < 0.2, 1, 0)
  exact u = if(abs(fraction(x - t) - 0.5) < 0.2, 1, 0)
  time 0 .. 2, step 1/100
}
scene bar : wind {
  grid x = 0 .. 1, cells 50
  boundary u: x.low = 0, x.high = zero_gradient
  initial u = if(abs(x - 0.5) < 0.2, 1, 0)
  exact u = 0
  time 0 .. 0.5, step 1/100
}
scene plate : stir {
  grid x = 0 .. 1, cells 40
  grid y = 0 .. 1, cells 40, periodic
  boundary u: x = zero_gradient
  initial u = if(abs(x - 0.5) < 0.2 and abs(y - 0.4) < 0.2, 1, 0)
  exact u = 0
  time 0 .. 1, step 1/100
}
)";

/// The clamp: never outside the previous range, bit-exact, at any Courant number; and still sharper than linear
/// interpolation.
TEST(MacCormack, MakesNoNewExtremum) {
  for (const char* scene : {"ring", "bar", "plate"}) {
    for (const char* step : {"1/100", "1/20", "1/8"}) {  // Courant numbers 0.5, 2.5, 6.25
      Overrides overrides = maccormack;
      overrides["step"] = step;
      const std::vector<double> u = run_scene(hats, scene, overrides).state.at("u");
      EXPECT_GE(*std::min_element(u.begin(), u.end()), 0) << scene << " " << step;
      EXPECT_LE(*std::max_element(u.begin(), u.end()), 1) << scene << " " << step;
    }
  }
  EXPECT_LT(run_scene(hats, "ring", maccormack).l2.at("u"), 0.85 * run_scene(hats, "ring", linear).l2.at("u"));
}

}  // namespace
}  // namespace dpde
