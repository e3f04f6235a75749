// SPDX-License-Identifier: Apache-2.0
// Derivatives that losses and observables take beside walls with values: exact for what is quadratic, with exact
// gradients.
#include <gtest/gtest.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// u stays what it is; the loss is the largest mistake of `derivative`.
std::string still(const std::string& u, const std::string& derivative, const std::string& wanted,
                  const std::string& scheme = "", const std::string& kind = "") {
  return "model m { field u; param c; dt(u) = 0*u }\nscheme e { time = euler" + scheme +
         " }\nscene s : m with e {\n  grid x = 0 .. 1, cells 6" + kind +
         "\n  grid y = -1 .. 1, cells 5\n  c = 1\n  boundary u: x.low = " + u + ", x.high = " + u + ", y.low = " + u +
         ", y.high = " + u + "\n  initial u = " + u +
         "\n  time 0 .. 1, step 1\n}\ntask t : s { unknown c; minimise c*max(abs(" + derivative + " - (" + wanted +
         "))) }\n";
}

TEST(WallParabola, DerivativesOfWhatIsQuadraticAreExactInAllCells) {
  const std::string u = "(1 + x - 2*x^2 + y^2 + 3*x*y + x^2*y - x*y^2)";
  EXPECT_LT(task_gradient(still(u, "lap(u)", "-4 + 2*y + 2 - 2*x"), "t").loss, 1e-11);
  EXPECT_LT(task_gradient(still(u, "dx(u)", "1 - 4*x + 3*y + 2*x*y - y^2"), "t").loss, 1e-12);
  EXPECT_LT(task_gradient(still(u, "dx(dy(u))", "3 + 2*x - 2*y"), "t").loss, 1e-11);
  EXPECT_LT(task_gradient(still(u, "dx(dx(u))", "-4 + 2*y"), "t").loss, 1e-11);
  EXPECT_LT(task_gradient(still(u, "lap(u)", "-4 + 2*y + 2 - 2*x", "; lap = central(4)"), "t").loss,
            1e-11);  // two halo cells
  EXPECT_LT(
      task_gradient(still(u, "d(u, y, 2) + mean(dx(u))", "2 - 2*x + mean(1 - 4*x + 3*y + 2*x*y - y^2)"), "t").loss,
      1e-11);
}

/// With respect to u at the wall and inside: a loss of second derivatives is a quadratic form, whose central difference
/// is exact.
TEST(WallParabola, GradientsAreExact) {
  const std::string text =
      "model m { field u; param a; dt(u) = 0*u }\nscheme e { time = euler; lap = central(4) }\nscene s : m with e {\n  "
      "grid x = 0 .. 1, cells 5\n"
      "  grid y = 0 .. 1, cells 3\n  a = 0.3\n  boundary u: x.low = a*y, x.high = a^2, y.low = zero_gradient, y.high = "
      "sin(a*x)\n"
      "  initial u = sin(3*x + y)*a\n  time 0 .. 1, step 1\n}\n"
      "task t : s { unknown a; minimise mean((lap(u) + dx(dy(u)))^2) }\ntask v : s { unknown initial u; minimise "
      "mean((lap(u) + dx(dy(u)))^2) }\n";
  const double slope = task_gradient(text, "t").gradient.at("a")[0];
  const double above = task_gradient(text, "t", {{"a", "0.3001"}}).loss,
               below = task_gradient(text, "t", {{"a", "0.2999"}}).loss;
  EXPECT_NEAR(slope, (above - below) / 0.0002, 1e-6 * std::abs(slope));
  std::string certified = text.substr(0, text.find("task t")) +
                          "task t : s { unknown a; unknown initial u; minimise mean((lap(u) + dx(dy(u)))^2) }\n";
  expect_certified(certified, false);
}

}  // namespace
}  // namespace dpde::testing
