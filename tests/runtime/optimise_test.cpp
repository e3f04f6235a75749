// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/optimise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace dpde {
namespace {

using Eigen::VectorXd;

/// sum of i x_i^2 / 2, i = 1, 2, ...
double bowl(const VectorXd& x, VectorXd& gradient) {
  double loss = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double weight = static_cast<double>(i + 1);
    loss += 0.5 * weight * x[i] * x[i];
    gradient[i] = weight * x[i];
  }
  return loss;
}

double rosenbrock(const VectorXd& x, VectorXd& gradient) {
  gradient.setZero();
  double loss = 0;
  for (Eigen::Index i = 0; i + 1 < x.size(); ++i) {
    const double a = x[i + 1] - x[i] * x[i], b = 1 - x[i];
    loss += 100 * a * a + b * b;
    gradient[i] += -400 * a * x[i] - 2 * b;
    gradient[i + 1] += 200 * a;
  }
  return loss;
}

TEST(Optimise, GradientDescentMakesTheStepsOfTheFormula) {
  const OptimiseResult result = minimise(GradientDescent{0.1}, bowl, VectorXd{{1.0, 2.0}}, 3);
  // x_1 shrinks by 0.9 an update, x_2 by 0.8.
  ASSERT_EQ(result.losses.size(), 4u);
  for (int k = 0; k <= 3; ++k) {
    EXPECT_NEAR(result.losses[static_cast<size_t>(k)], 0.5 * std::pow(0.81, k) + 4 * std::pow(0.64, k), 1e-14);
  }
  EXPECT_NEAR(result.x[0], 0.729, 1e-15);
  EXPECT_NEAR(result.x[1], 2 * 0.512, 1e-15);
  EXPECT_EQ(result.loss, result.losses.back());
  EXPECT_EQ(result.iterations, 3);
  EXPECT_EQ(result.evaluations, 4);
  EXPECT_EQ(result.reason, StopReason::iterations);
}

TEST(Optimise, AdamMakesTheStepsOfThePaper) {
  // f = 3 x: the gradient is 3 always; the corrected moments are 3 and 9: each update is rate * 3 / (3 + epsilon).
  const auto line = [](const VectorXd& x, VectorXd& gradient) {
    gradient[0] = 3;
    return 3 * x[0];
  };
  const OptimiseResult result = minimise(Adam{0.01}, line, VectorXd{{1.0}}, 5);
  EXPECT_NEAR(result.x[0], 1 - 5 * 0.01 * 3 / (3 + 1e-8), 1e-15);
  // Two steps on x^2 / 2 from 1 with rate 0.1, by hand.
  const auto square = [](const VectorXd& x, VectorXd& gradient) {
    gradient = x;
    return 0.5 * x[0] * x[0];
  };
  const double x1 = 1 - 0.1 / (1 + 1e-8);
  const double mean = (0.9 * 0.1 + 0.1 * x1) / (1 - 0.81), second = (0.999 * 0.001 + 0.001 * x1 * x1) / (1 - 0.999 * 0.999);
  EXPECT_NEAR(minimise(Adam{0.1}, square, VectorXd{{1.0}}, 2).x[0], x1 - 0.1 * mean / (std::sqrt(second) + 1e-8), 1e-14);
}

TEST(Optimise, AdamFindsTheMinimum) {
  const OptimiseResult result = minimise(Adam{0.05}, bowl, VectorXd::Constant(5, 1.0), 2000);
  EXPECT_LT(result.loss, 1e-10);
}

TEST(Optimise, LbfgsOnABowl) {
  const OptimiseResult result = minimise(Lbfgs{}, bowl, VectorXd::LinSpaced(50, -1, 2), 200, {}, 1e-10);
  EXPECT_EQ(result.reason, StopReason::gradient_zero);
  EXPECT_LT(result.x.lpNorm<Eigen::Infinity>(), 1e-10);
  EXPECT_LT(result.evaluations, 100);
}

TEST(Optimise, LbfgsOnRosenbrock) {
  for (int n : {2, 10, 40}) {
    const OptimiseResult result = minimise(Lbfgs{}, rosenbrock, VectorXd::Constant(n, -1.2), 2000, {}, 1e-9);
    EXPECT_LT((result.x - VectorXd::Ones(n)).lpNorm<Eigen::Infinity>(), 1e-8) << n << " unknowns, " << describe(result.reason);
    EXPECT_LT(result.evaluations, 60 + 15 * n);
    for (size_t k = 1; k < result.losses.size(); ++k) EXPECT_LE(result.losses[k], result.losses[k - 1]);
    EXPECT_EQ(result.losses.size(), static_cast<size_t>(result.iterations) + 1);
  }
}

TEST(Optimise, LbfgsStopsWhereRoundingEndsProgress) {
  const OptimiseResult result = minimise(Lbfgs{}, rosenbrock, VectorXd{{-1.2, 1.0}}, 100000);
  EXPECT_NE(result.reason, StopReason::iterations);
  EXPECT_LT(result.loss, 1e-20);
}

TEST(Optimise, LbfgsShortensStepsThatLeaveTheDomain) {
  const auto log_barrier = [](const VectorXd& x, VectorXd& gradient) {  // finite for x > 0 only, minimum at 1e-3
    gradient[0] = 1 - 1e-3 / x[0];
    return x[0] - 1e-3 * std::log(x[0]);
  };
  const OptimiseResult result = minimise(Lbfgs{}, log_barrier, VectorXd{{1.0}}, 100, {}, 1e-9);
  EXPECT_NEAR(result.x[0], 1e-3, 1e-10);
}

TEST(Optimise, ALossThatIsNotFiniteStopsWithTheBestPoint) {
  const auto cliff = [](const VectorXd& x, VectorXd& gradient) {
    gradient[0] = 1;
    return x[0] < -2 ? std::numeric_limits<double>::quiet_NaN() : x[0];
  };
  const OptimiseResult result = minimise(GradientDescent{1}, cliff, VectorXd{{1.0}}, 10);
  EXPECT_EQ(result.reason, StopReason::not_finite);
  EXPECT_EQ(result.x[0], -2);
  EXPECT_EQ(result.loss, -2);
  EXPECT_EQ(result.losses.size(), 5u);
  EXPECT_TRUE(std::isnan(result.losses.back()));
  for (const OptimiseResult& at_start : {minimise(Adam{}, cliff, VectorXd{{-3.0}}, 10), minimise(Lbfgs{}, cliff, VectorXd{{-3.0}}, 10)}) {
    EXPECT_EQ(at_start.reason, StopReason::not_finite);
    EXPECT_EQ(at_start.x[0], -3);
    EXPECT_EQ(at_start.iterations, 0);
  }
}

TEST(Optimise, TheObserverSeesEveryIterateAndMayStop) {
  for (int method : {0, 1, 2}) {
    std::vector<double> losses;
    const IterationObserver observer = [&](const Iteration& at) {
      EXPECT_EQ(at.iteration, static_cast<int>(losses.size()));
      VectorXd gradient(at.x.size());
      EXPECT_EQ(rosenbrock(at.x, gradient), at.loss);
      EXPECT_EQ(gradient.norm(), at.gradient_norm);
      losses.push_back(at.loss);
      return losses.size() < 5;
    };
    const VectorXd x{{-1.2, 1.0}};
    const OptimiseResult result = method == 0   ? minimise(GradientDescent{1e-4}, rosenbrock, x, 100, observer)
                                  : method == 1 ? minimise(Adam{}, rosenbrock, x, 100, observer)
                                                : minimise(Lbfgs{}, rosenbrock, x, 100, observer);
    EXPECT_EQ(result.reason, StopReason::observer);
    EXPECT_EQ(result.losses, losses);
    EXPECT_EQ(result.iterations, 4);
  }
}

TEST(Optimise, ZeroIterationsEvaluateOnce) {
  const OptimiseResult result = minimise(Lbfgs{}, bowl, VectorXd{{1.0}}, 0);
  EXPECT_EQ(result.evaluations, 1);
  EXPECT_EQ(result.loss, 0.5);
  EXPECT_EQ(result.reason, StopReason::iterations);
}

/// 0.5*|x - (k - 2)|^2 scaled by k + 1, within 0 .. 1: the nearest point.
TEST(Bounds, EveryMethodEndsAtTheNearestPointWithin) {
  const Objective stretched = [](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    double loss = 0;
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const double d = x[k] - (0.75 * static_cast<double>(k) - 0.9), weight = static_cast<double>(k) + 1;
      loss += 0.5 * weight * d * d;
      gradient[k] = weight * d;
    }
    return loss;
  };
  const HessianProduct product = [](const Eigen::VectorXd&, const Eigen::VectorXd& v, Eigen::VectorXd& result) {
    for (Eigen::Index k = 0; k < v.size(); ++k) result[k] = (static_cast<double>(k) + 1) * v[k];
  };
  const Bounds bounds{Eigen::VectorXd::Zero(5), Eigen::VectorXd::Ones(5)};
  const Eigen::VectorXd start = Eigen::VectorXd::Constant(5, 3.0);
  const std::vector<OptimiseResult> results = {
      minimise(GradientDescent{0.2}, stretched, start, 500, {}, 1e-12, bounds),
      minimise(Lbfgs{}, stretched, start, 100, {}, 1e-12, bounds),
      minimise(NewtonCg{}, stretched, product, start, 100, {}, 1e-12, bounds),
      minimise(Adam{0.01}, stretched, start, 3000, {}, 1e-12, bounds)};
  for (std::size_t m = 0; m < results.size(); ++m) {
    for (int k = 0; k < 5; ++k) {
      const double nearest = std::min(1.0, std::max(0.0, 0.75 * k - 0.9));
      EXPECT_NEAR(results[m].x[k], nearest, m == 3 ? 1e-4 : 1e-10) << "method " << m << ", component " << k;
    }
    if (m < 3) {
      EXPECT_EQ(results[m].reason, StopReason::gradient_zero) << m;
    }
  }
}

}  // namespace
}  // namespace dpde
