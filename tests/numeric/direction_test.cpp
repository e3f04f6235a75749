// SPDX-License-Identifier: Apache-2.0
// Gradients of flows with a constraint against central differences of the loss, in 20 directions each: the best of
// three step lengths agrees to 1e-8 of the derivative.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "support/flow_texts.h"
#include "support/opened_scene.h"

namespace dpde::testing {
namespace {

constexpr int directions = 20;

/// The largest error over the directions, relative to the derivative.
double worst_error(const std::string& text) {
  OpenedScene opened(text, "t", {.adjoint = true});
  const auto inverse = opened.inverse();
  if (!inverse) return INFINITY;
  const Eigen::VectorXd start = inverse->start();
  Eigen::VectorXd gradient(inverse->size()), direction(inverse->size());
  inverse->value_and_gradient(start, gradient);
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  double worst = 0;
  for (int k = 0; k < directions; ++k) {
    for (double& d : direction) d = normal(random);
    const double exact = gradient.dot(direction);
    double best = INFINITY;
    for (const double h : {1e-4, 2e-5, 4e-6}) {
      const double found = (inverse->value(start + h * direction) - inverse->value(start - h * direction)) / (2 * h);
      best = std::min(best, std::abs(found / exact - 1));
    }
    worst = std::max(worst, best);
  }
  return worst;
}

const std::string around_a_disc = R"(
  grid x = 0 .. 1, cells 24, periodic
  grid y = 0 .. 1, cells 20
  boundary u: y = (0, 0)
  nu = 0.02
  solid = (x - 0.5)^2 + (y - 0.5)^2 < 0.03
  initial u = (4*y*(1 - y), 0)
  time 0 .. 0.1, step 1/100
}
task t : s { unknown initial u; unknown nu; minimise mean(u.x^2) + mean(u.y^2); minimise mean(u.x^3) over time }
)";

TEST(Directions, TwentyOfFlowsAgreeWithCentralDifferences) {
  for (const char* time : {"rk2", "rk4", "ars222"}) {
    const std::string scheme = std::string("scheme c { time = ") + time + " }\nscene s : m with c {";
    EXPECT_LT(worst_error(flow_around_a_solid + scheme + around_a_disc), 1e-8) << time;
  }
}

TEST(Directions, TwentyOfAStreamFunctionAgreeWithCentralDifferences) {
  const std::string scene = R"(
scene s : m {
  grid x = 0 .. 1, cells 16
  grid y = 0 .. 1, cells 12
  boundary w: all = 0
  boundary psi: all = 0
  nu = 0.01
  k = 1 + 0.5*sin(7*x)*cos(5*y)
  initial w = 10*sin(pi*x)*sin(2*pi*y)
  time 0 .. 0.1, step 1/100
}
task t : s { unknown initial w; unknown k; unknown nu; minimise mean(w^2) + mean(psi^2) over time }
)";
  EXPECT_LT(worst_error(flow_over_an_uneven_bed + scene), 1e-8);
}

}  // namespace
}  // namespace dpde::testing
