// SPDX-License-Identifier: Apache-2.0
// Newton's method on problems with a known minimiser.
#include <gtest/gtest.h>

#include <cmath>

#include "dpde/runtime/optimise.h"

namespace dpde {
namespace {

/// 0.5 sum of (k + 1)^4 (x_k - k)^2: condition number 1e8 for 100 unknowns.
double stretched(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  double loss = 0;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const double weight = std::pow(k + 1.0, 4), d = x[k] - static_cast<double>(k);
    loss += 0.5 * weight * d * d;
    gradient[k] = weight * d;
  }
  return loss;
}

TEST(NewtonCg, SolvesAQuadraticInFewSteps) {
  const HessianProduct product = [](const Eigen::VectorXd&, const Eigen::VectorXd& v, Eigen::VectorXd& result) {
    for (Eigen::Index k = 0; k < v.size(); ++k) result[k] = std::pow(k + 1.0, 4) * v[k];
  };
  const OptimiseResult result = minimise(NewtonCg{}, stretched, product, Eigen::VectorXd::Zero(6), 10, {}, 1e-8);
  EXPECT_EQ(result.reason, StopReason::gradient_zero);
  EXPECT_LE(result.iterations, 8);
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(result.x[k], k, 1e-9);
  EXPECT_GT(result.hessian_products, 0);
}

double rosenbrock_with_hessian(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  const double a = 1 - x[0], b = x[1] - x[0] * x[0];
  gradient[0] = -2 * a - 400 * x[0] * b;
  gradient[1] = 200 * b;
  return a * a + 100 * b * b;
}

void rosenbrock_hessian(const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result) {
  result[0] = (2 - 400 * (x[1] - 3 * x[0] * x[0])) * v[0] - 400 * x[0] * v[1];
  result[1] = -400 * x[0] * v[0] + 200 * v[1];
}

/// The valley is curved and the Hessian indefinite on the way, which requires the trust region.
TEST(NewtonCg, FollowsTheValleyOfRosenbrock) {
  Eigen::VectorXd start(2);
  start << -1.2, 1.0;
  const OptimiseResult result =
      minimise(NewtonCg{}, rosenbrock_with_hessian, rosenbrock_hessian, start, 100, {}, 1e-10);
  EXPECT_NEAR(result.x[0], 1, 1e-9);
  EXPECT_NEAR(result.x[1], 1, 1e-9);
  EXPECT_LT(result.iterations, 40);
  for (std::size_t k = 1; k < result.losses.size(); ++k) EXPECT_LE(result.losses[k], result.losses[k - 1]);
}

/// From a maximum along negative curvature to the minimum of (x^2 - 1)^2 + y^2.
TEST(NewtonCg, LeavesAHillAlongNegativeCurvature) {
  const Objective hill = [](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    gradient[0] = 4 * x[0] * (x[0] * x[0] - 1);
    gradient[1] = 2 * x[1];
    return std::pow(x[0] * x[0] - 1, 2) + x[1] * x[1];
  };
  const HessianProduct product = [](const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result) {
    result[0] = (12 * x[0] * x[0] - 4) * v[0];
    result[1] = 2 * v[1];
  };
  Eigen::VectorXd start(2);
  start << 0.01, 1;
  const OptimiseResult result = minimise(NewtonCg{}, hill, product, start, 50, {}, 1e-9);
  EXPECT_NEAR(std::abs(result.x[0]), 1, 1e-8);
  EXPECT_NEAR(result.x[1], 0, 1e-8);
}

TEST(NewtonCg, StopsWhereNoStepIsFinite) {
  const HessianProduct bad = [](const Eigen::VectorXd&, const Eigen::VectorXd&, Eigen::VectorXd& result) {
    result.setConstant(NAN);
  };
  const OptimiseResult result = minimise(NewtonCg{}, stretched, bad, Eigen::VectorXd::Zero(3), 5);
  EXPECT_EQ(result.reason, StopReason::no_progress);
  EXPECT_EQ(result.iterations, 0);
}

}  // namespace
}  // namespace dpde
