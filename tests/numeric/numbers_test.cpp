// SPDX-License-Identifier: Apache-2.0
// Losses and observables that are arbitrary numbers: (integral(u) - d)^2, ratios, roots and products of reductions,
// against hand calculations; certified first and second derivatives.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "../driver/driver_support.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// Two species that diffuse, decay and react. The second axis has walls.
std::string pair_of(const std::string& grids, const std::string& sides, const std::string& lines) {
  return "model m { field u, v; param k; dt(u) = 0.01*lap(u) - k*u*v; dt(v) = 0.02*lap(v) - k*u*v }\n"
         "scheme c { time = rk2 }\nscene s : m with c {\n" +
         grids + sides +
         "  k = 0.7\n  initial u = 1 + 0.3*sin(3*x)\n  initial v = 2 + x^2\n  time 0 .. 1/4, step 1/32\n"
         "  observe total = integral(u)\n}\n"
         "scene truth = s { k = 1.1 }\ntask t : s {\n  data d = total from scene truth over time\n  unknown k\n"
         "  unknown initial u\n" +
         lines + "}\n";
}

const std::string walls = "  boundary u: x.low = zero_gradient, x.high = 0.4\n  boundary v = zero_gradient\n";

/// On one cell the variance is 0, where its power has two derivatives.
TEST(Numbers, HaveCertifiedDerivatives) {
  for (std::size_t count = 0;
       const char* loss : {"(integral(u) - d)^2, mean over time", "(integral(u) - d)^2, sum over time",
                           "sqrt(mean(u^2)) + integral(u)*mean(v)^2", "mean(u^2)/integral(v), integral over time",
                           "d*integral(u) - exp(mean(v) - max(u)), mean over time",
                           "if(mean(u) > 0.1, (mean(u) - 0.1)^2, 0) + k*mean(v)^3 at t = 1/8, 1/4",
                           "(sample(u, at = 0.4) - integral(v))^2 + integral((u - mean(u))^2)^2.5"})
    for (const int cells : {1, 2, 9}) {
      if (!testing::is_tried(count++, 2)) continue;
      expect_certified(pair_of("  grid x = 0 .. 1, cells " + std::to_string(cells) + "\n", walls,
                               std::string("  minimise ") + loss + "\n"),
                       true);
    }
}

TEST(Numbers, HaveCertifiedDerivativesInThePlaneAndOnFaces) {
  const std::string grids = "  grid x = 0 .. 1, cells 5\n  grid y = 0 .. 1, cells 3, periodic\n";
  expect_certified(pair_of(grids, walls, "  minimise (integral(u) - d)^2 + mean(u)*mean(v), mean over time\n"), true);
  expect_certified(R"(
model m { vector u on faces; dt(u) = 0.02*lap(u) - advect(u, u) }
scheme c { time = rk2 }
scene s : m with c {
  grid x = 0 .. 1, cells 5
  grid y = 0 .. 1, cells 4, periodic
  boundary u: x = (0, 0.2)
  initial u = (x*(1 - x), x)
  time 0 .. 1/4, step 1/32
}
task t : s { unknown initial u; minimise (mean(u.x) - integral(u.y)^2)^2 + sqrt(mean(u.x^2)), mean over time }
)",
                   true);
}

/// Uniform decay has a known total: loss and slope follow from the step's factor R.
TEST(Numbers, AreWhatTheyAreByHand) {
  const std::string text = R"(
model m { field u; param k; dt(u) = -k*u }
scheme c { time = euler }
scene s : m with c { grid x = 0 .. 2, cells 4, periodic; k = 0.5; initial u = x; time 0 .. 1, step 1/4
  observe ratio = max(u)/integral(u) }
task t : s { unknown k; minimise sqrt(integral(u))*mean(u), sum over time }
)";
  double loss = 0, slope = 0;
  for (int n = 0; n <= 4; ++n) {  // integral 2 R^n, mean R^n, R = 1 - k/4
    const double r = 1 - 0.5 / 4;
    loss += std::sqrt(2) * std::pow(r, 1.5 * n);
    slope += std::sqrt(2) * 1.5 * n * std::pow(r, 1.5 * n - 1) * -0.25;
  }
  const TaskResult result = task_gradient(text, "t");
  EXPECT_NEAR(result.loss, loss, 1e-13);
  EXPECT_NEAR(result.gradient.at("k")[0], slope, 1e-13);
}

}  // namespace
}  // namespace dpde::testing
