// SPDX-License-Identifier: Apache-2.0
// Update rules against their formulas in plain numbers, and Adam against the one of tasks.
#include "dpde/runtime/update_rule.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dpde {
namespace {

Eigen::VectorXd vector(std::initializer_list<double> values) {
  Eigen::VectorXd result(static_cast<Eigen::Index>(values.size()));
  std::ranges::copy(values, result.data());
  return result;
}

TEST(UpdateRule, GradientDescentWithMomentum) {
  const UpdateRule rule{UpdateRule::Kind::gradient_descent, 0.5, 0.9, 0, 0, {}};
  UpdateState state = begin_updates(rule, vector({1, 2}));
  Eigen::VectorXd gradient = vector({0.5, -1});
  update(rule, state, gradient, 2);
  EXPECT_EQ(state.x, vector({0.75, 2.5}));
  gradient = vector({1, 0});
  update(rule, state, gradient, 2);  // momentum: 0.9*0.5 + 1 and -0.9
  EXPECT_NEAR(state.x[0], 0.75 - 0.5 * 1.45, 1e-15);
  EXPECT_NEAR(state.x[1], 2.5 + 0.5 * 0.9, 1e-15);
}

TEST(UpdateRule, AdamIsTheTasks) {
  const auto slope = [](const Eigen::VectorXd& x) { return Eigen::VectorXd(2 * x.array() * vector({1, 10}).array()); };
  const Objective objective = [&](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient = slope(x);
    return x.dot(gradient) / 2;
  };
  const OptimiseResult expected = minimise(Adam{0.1}, objective, vector({1, -1}), 25);
  const UpdateRule rule{UpdateRule::Kind::adam, 0.1, 0, 0, 0, {}};
  UpdateState state = begin_updates(rule, vector({1, -1}));
  for (int k = 0; k < 25; ++k) {
    Eigen::VectorXd gradient = slope(state.x);
    update(rule, state, gradient, 25);
  }
  EXPECT_EQ(state.x, expected.x);
}

TEST(UpdateRule, DecayClippingAndBounds) {
  UpdateRule rule{UpdateRule::Kind::gradient_descent, 0.1, 0, 0.5, 0, {}};
  UpdateState state = begin_updates(rule, vector({2}));
  Eigen::VectorXd gradient = vector({0});
  update(rule, state, gradient, 1);
  EXPECT_NEAR(state.x[0], 2 * (1 - 0.05), 1e-15) << "decay is not part of the gradient";
  rule = {UpdateRule::Kind::gradient_descent, 1, 0, 0, 0.5, {}};
  state = begin_updates(rule, vector({0, 0}));
  gradient = vector({3, 4});
  update(rule, state, gradient, 1);
  EXPECT_NEAR(state.x[0], -0.3, 1e-15);
  EXPECT_NEAR(state.x[1], -0.4, 1e-15);
  update(rule, state, gradient, 1, {vector({-0.5, -10}), vector({1, 1})});
  EXPECT_EQ(state.x[0], -0.5);
}

TEST(UpdateRule, Schedules) {
  const RateSchedule halve{RateSchedule::Kind::halve, 10}, cosine{RateSchedule::Kind::cosine, 1};
  EXPECT_EQ(halve.factor(9, 100), 1);
  EXPECT_EQ(halve.factor(10, 100), 0.5);
  EXPECT_EQ(halve.factor(35, 100), 0.125);
  EXPECT_EQ(cosine.factor(0, 100), 1);
  EXPECT_NEAR(cosine.factor(50, 100), 0.5, 1e-15);
  EXPECT_NEAR(cosine.factor(75, 100), 0.5 - std::sqrt(0.5) / 2, 1e-15);
  EXPECT_EQ(RateSchedule{}.factor(99, 100), 1);
  const UpdateRule rule{UpdateRule::Kind::gradient_descent, 1, 0, 0, 0, halve};
  UpdateState state = begin_updates(rule, vector({0}));
  for (int k = 0; k < 20; ++k) {
    Eigen::VectorXd gradient = vector({1});
    update(rule, state, gradient, 20);
  }
  EXPECT_EQ(state.x[0], -15);
}

}  // namespace
}  // namespace dpde
