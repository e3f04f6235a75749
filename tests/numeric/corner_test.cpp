// SPDX-License-Identifier: Apache-2.0
// At corners of walls values beyond the corner are of order 2 in the maximum norm if the walls' values agree there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "support/scene_run.h"

namespace dpde::testing {
namespace {

using Exact = std::function<double(double x, double y)>;  // at the end
/// Position of a field's points in their cells, in cells from the low sides.
struct Place {
  double x = 0.5, y = 0.5;
};

/// Order of the field's largest error when cells are halved.
double order_of(const std::string& text, const std::string& field, const Exact& exact, Place place = {}) {
  const auto error = [&](int n) {
    const std::vector<double> values = run_scene(text, "s", {{"cells", std::to_string(n)}}).state.at(field);
    double largest = 0;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i)
        largest = std::max(largest, std::abs(values[i + n * j] - exact((i + place.x) / n, (j + place.y) / n)));
    }
    return largest;
  };
  return std::log2(error(16) / error(32));
}

/// A plate with an anisotropic flux, K times the gradient; u = exp(-t)*s is the solution.
std::string plate(const std::string& boundary) {
  return "model m {\n  field u; coefficient k11, k12, k22, q\n"
         "  dt(u) = dx(k11*dx(u) + k12*dy(u)) + dy(k12*dx(u) + k22*dy(u))\n"
         "    - exp(-t)*(c(x, y)*(12*y + 5)/120 + s(x, y)*(18 + y - 8*x - 12*x*y)/60)\n}\n"
         "function s(x, y) = sin(2*x + y + 0.3)\nfunction c(x, y) = cos(2*x + y + 0.3)\n"
         "scheme rk { time = rk4 }\nscene s : m with rk {\n  grid x = 0 .. 1, cells 16\n  grid y = 0 .. 1, cells 16\n"
         "  k11 = 0.1*(1 + x*y/2)\n  k12 = 0.05*(1 + x/2 - y/3)\n  k22 = 0.1*(1 + x/3 + y/2)\n  q = c(x, y)\n"
         "  boundary u: " +
         boundary + "\n  initial u = s(x, y)\n  time 0 .. 1/8, step 1/1024\n}\n";
}

TEST(Corners, OfFluxesByTensorsAreOfOrder2) {
  const Exact u = [](double x, double y) { return std::exp(-0.125) * std::sin(2 * x + y + 0.3); };
  const std::string values =
      "x.low = exp(-t)*s(0, y), x.high = exp(-t)*s(1, y), y.low = exp(-t)*s(x, 0), y.high = exp(-t)*s(x, 1)";
  EXPECT_NEAR(order_of(plate(values), "u", u), 2, 0.2);
  // A value, a slope with a coefficient, a slope with the field itself, and a mixed condition.
  const std::string others =
      "x.low = exp(-t)*s(0, y), x.high = gradient(2*exp(-t)*q), y.low = gradient(exp(-t)*(s(x, 0) - c(x, 0)) - u), "
      "y.high = mixed(1, 0.5, exp(-t)*(s(x, 1) + 0.5*c(x, 1)))";
  EXPECT_NEAR(order_of(plate(others), "u", u), 2, 0.2);
}

/// Velocities on faces advect one another: next to a corner each is interpolated beyond the walls of the other.
TEST(Corners, OfFlowsOnFacesAreOfOrder2) {
  const std::string text =
      "model m {\n  vector v on faces\n  dt(v) = 0.05*lap(v) - advect(v, v) + (\n"
      "    a(x, y, t)*(ac(x, y, t) - 0.75) + 2*b(x, y, t)*ac(x, y, t),\n"
      "    b(x, y, t)*(0.25 + bc(x, y, t)) - sin(t)*cos(2*x - y + 0.2) - 2*bc(x, y, t)*a(x, y, t))\n}\n"
      "function a(x, y, t) = exp(-t)*sin(x + 2*y + 0.3)\nfunction ac(x, y, t) = exp(-t)*cos(x + 2*y + 0.3)\n"
      "function b(x, y, t) = cos(t)*cos(2*x - y + 0.2)\nfunction bc(x, y, t) = cos(t)*sin(2*x - y + 0.2)\n"
      "scheme rk { time = rk4 }\nscene s : m with rk {\n  grid x = 0 .. 1, cells 16\n  grid y = 0 .. 1, cells 16\n"
      "  boundary v.x: x.low = a(0, y, t), x.high = a(1, y, t), y.low = a(x, 0, t), y.high = a(x, 1, t)\n"
      "  boundary v.y: x.low = b(0, y, t), x.high = gradient(-2*bc(1, y, t)), y.low = b(x, 0, t), y.high = b(x, 1, t)\n"
      "  initial v = (a(x, y, 0), b(x, y, 0))\n  time 0 .. 1/8, step 1/512\n}\n";
  const Exact a = [](double x, double y) { return std::exp(-0.125) * std::sin(x + 2 * y + 0.3); };
  const Exact b = [](double x, double y) { return std::cos(0.125) * std::cos(2 * x - y + 0.2); };
  EXPECT_NEAR(order_of(text, "v.x", a, {1, 0.5}), 2, 0.2);
  EXPECT_NEAR(order_of(text, "v.y", b, {0.5, 1}), 2, 0.2);
}

}  // namespace
}  // namespace dpde::testing
