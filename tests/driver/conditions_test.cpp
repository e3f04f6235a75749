// SPDX-License-Identifier: Apache-2.0
// Each condition at a side by what is done with a scene: its text for the key of compiled code, runs by two back ends,
// a gradient against differences and tangents.
#include <gtest/gtest.h>

#include <cmath>

#include "loop/print_loop.h"
#include "support/opened_scene.h"
#include "support/scene_run.h"
#include "support/side_conditions.h"

namespace dpde::driver {
namespace {

namespace testing = dpde::testing;

/// As a person writes it, for a field u at the side x.high; empty: of no model.
std::vector<std::string> written(const SideCondition& condition) {
  switch (condition.kind) {
    case SideKind::value: return {"0", "0.5", "sin(t)", "q*u"};
    case SideKind::zero_gradient: return {"zero_gradient"};
    case SideKind::gradient: return {"gradient(0.3)", "gradient(-q*u)", "gradient(cos(t))"};
    case SideKind::mixed: return {"mixed(1, 0.5, 0.2)", "mixed(q, 1, 0)", "mixed(1, q, sin(t))"};
    case SideKind::linear: return {"linear"};
    case SideKind::outflow: return {"outflow"};
    case SideKind::radiating: return {"radiating(1)", "radiating(q)"};
    case SideKind::pole:
    case SideKind::opposite_pole:
    case SideKind::gradient_at_cell:
    case SideKind::line: return {};  // written of poles (numeric/pole_test), and by the compiler alone
  }
  return {};
}

std::string scene_text(const std::string& side) {
  return R"(model wave { field u; param k, q; dt(dt(u)) = k*lap(u) - 0.1*dt(u) }
scheme s { time = rk4 }
scene string : wave with s {
  grid x = 0 .. 1, cells 12
  k = 1; q = 0.8
  boundary u: x.low = 0, x.high = )" +
         side + R"(
  initial u = exp(-30*(x - 0.6)^2)
  initial dt(u) = 0
  time 0 .. 0.1, step 0.01
}
task find : string { unknown k from 1.1; unknown q from 0.7; unknown initial u; minimise mean(u^2) at t = 0.1 }
)";
}

class Conditions : public ::testing::TestWithParam<std::string> {};

TEST_P(Conditions, AtEveryLevelAndByEveryVerb) {
  const std::string text = scene_text(GetParam());
  testing::OpenedScene scene(text, "find", {.adjoint = true, .tangent = true});
  ASSERT_NE(scene.session, nullptr);
  EXPECT_FALSE(loop::print(scene.session->compiled().loop).empty());
  const auto inverse = scene.inverse();
  ASSERT_NE(inverse, nullptr);
  const Eigen::VectorXd x = inverse->start();
  Eigen::VectorXd gradient(x.size());
  inverse->value_and_gradient(x, gradient);
  const Eigen::VectorXd direction = Eigen::VectorXd::LinSpaced(x.size(), -1, 1);
  constexpr double h = 1e-4;
  const double difference = (inverse->value(x + h * direction) - inverse->value(x - h * direction)) / (2 * h);
  EXPECT_NEAR(difference, gradient.dot(direction), 1e-6 * gradient.norm() * direction.norm());
  EXPECT_NEAR(inverse->rate_along(x, direction), gradient.dot(direction), 1e-11 * gradient.norm() * direction.norm());
  const testing::SceneResult compiled = testing::run_scene(text, "string"),
                             interpreted = testing::run_scene(text, "string", {}, Backend::interpreter);
  for (std::size_t i = 0; i < compiled.state.at("u").size(); ++i)
    EXPECT_NEAR(compiled.state.at("u")[i], interpreted.state.at("u")[i], 1e-12);
}

std::vector<std::string> all() {
  std::vector<std::string> sides;
  for (const SideCondition& condition : side_condition_table()) {
    for (std::string& side : written(condition)) sides.push_back(std::move(side));
  }
  return sides;
}

INSTANTIATE_TEST_SUITE_P(OfTheTable, Conditions, ::testing::ValuesIn(all()));

}  // namespace
}  // namespace dpde::driver
