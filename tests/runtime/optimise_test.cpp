// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/optimise.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/unknown_scales.h"

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
  // x_1 shrinks by the factor 0.9 per update, x_2 by 0.8.
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
  // f = 3 x: the gradient is always 3; the corrected moments are 3 and 9: each update is rate * 3 / (3 + epsilon).
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
  const double mean = (0.9 * 0.1 + 0.1 * x1) / (1 - 0.81),
               second = (0.999 * 0.001 + 0.001 * x1 * x1) / (1 - 0.999 * 0.999);
  EXPECT_NEAR(minimise(Adam{0.1}, square, VectorXd{{1.0}}, 2).x[0], x1 - 0.1 * mean / (std::sqrt(second) + 1e-8),
              1e-14);
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
    EXPECT_LT((result.x - VectorXd::Ones(n)).lpNorm<Eigen::Infinity>(), 1e-8)
        << n << " unknowns, " << describe(result.reason);
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

/// A fit of two exponentials to data of the same formula, so that it can be exact up to the rounding of the residuals.
double fit(const VectorXd& x, VectorXd& gradient) {
  gradient.setZero();
  double loss = 0;
  for (int k = 0; k < 200; ++k) {
    const double t = 0.05 * k, a = std::exp(-x[1] * t), b = std::exp(-x[3] * t);
    const double r = x[0] * a + x[2] * b - (1.3 * std::exp(-0.7 * t) + 0.4 * std::exp(-2.1 * t));
    loss += r * r / 200;
    gradient += 2 * r / 200 * VectorXd{{a, -x[0] * t * a, b, -x[2] * t * b}};
  }
  return loss;
}

TEST(Optimise, LbfgsStopsWhereTheLossIsRounding) {
  const VectorXd start{{1.0, 1.0, 1.0, 3.0}};
  for (const double offset : {0.0, 3.0}) {
    const Objective objective = [&](const VectorXd& x, VectorXd& gradient) { return offset + fit(x, gradient); };
    for (const Bounds& bounds : {Bounds{}, Bounds{VectorXd::Constant(4, -9.0), VectorXd::Constant(4, 9.0)}}) {
      const OptimiseResult result = minimise(Lbfgs{}, objective, start, 5000, {}, 0, bounds);
      VectorXd gradient(4);
      const double level = 1.3e-29 * fit(start, gradient);
      if (offset == 0) {
        EXPECT_LE(std::ranges::count_if(result.losses, [&](double loss) { return loss < level; }), 6)
            << "losses that are rounding";
      }
      EXPECT_LE(result.evaluations, 3 * result.iterations / 2 + 8) << offset;
      EXPECT_LT(result.loss - offset, offset == 0 ? 1e-25 : 1e-14);
    }
  }
}

/// From a distant start the first loss is 1e26. Later losses, small in comparison, must not stop the method.
TEST(Optimise, LbfgsGoesOnFromAFirstLossThatWasFarTooLarge) {
  for (const Bounds& bounds : {Bounds{}, Bounds{VectorXd::Constant(2, -1e7), VectorXd::Constant(2, 1e7)}}) {
    const OptimiseResult result = minimise(Lbfgs{}, rosenbrock, VectorXd{{1e6, -1e6}}, 5000, {}, 1e-9, bounds);
    EXPECT_NEAR(result.x[0], 1, 1e-8);
    EXPECT_NEAR(result.x[1], 1, 1e-8);
  }
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
  for (const OptimiseResult& at_start :
       {minimise(Adam{}, cliff, VectorXd{{-3.0}}, 10), minimise(Lbfgs{}, cliff, VectorXd{{-3.0}}, 10)}) {
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

/// A loaded beam on supports, x.Ax/2 - b.x with coupled neighbours, within 0 .. 1. The problem is convex, so a
/// projected gradient of 0 identifies the minimum. It is neither the minimum without bounds nor its nearest point.
TEST(Bounds, EveryMethodEndsAtTheMinimumWithin) {
  constexpr int size = 7;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  for (int i = 0; i < size; ++i) {
    matrix(i, i) = 2.2;
    if (i > 0) matrix(i, i - 1) = matrix(i - 1, i) = -1;
  }
  const VectorXd load{{-1.0, 0.4, 2.0, 2.5, -0.3, -2.0, 0.6}};
  const Objective beam = [&](const VectorXd& x, VectorXd& gradient) {
    gradient = matrix * x - load;
    return 0.5 * x.dot(matrix * x) - load.dot(x);
  };
  const HessianProduct product = [&](const VectorXd&, const VectorXd& v, VectorXd& result) { result = matrix * v; };
  const Bounds bounds{VectorXd::Zero(size), VectorXd::Ones(size)};
  const VectorXd start = VectorXd::Constant(size, 3.0), free = matrix.ldlt().solve(load);
  const auto clipped = [](const VectorXd& x) -> VectorXd { return x.cwiseMax(0.0).cwiseMin(1.0); };
  const std::vector<OptimiseResult> results = {minimise(GradientDescent{0.2}, beam, start, 500, {}, 1e-12, bounds),
                                               minimise(Lbfgs{}, beam, start, 100, {}, 1e-12, bounds),
                                               minimise(NewtonCg{}, beam, product, start, 100, {}, 1e-12, bounds),
                                               minimise(Adam{0.002}, beam, start, 20000, {}, 1e-12, bounds)};
  for (std::size_t m = 0; m < results.size(); ++m) {
    const VectorXd& x = results[m].x;
    EXPECT_LT((clipped(x - (matrix * x - load)) - x).norm(), m == 3   ? 1e-3
                                                             : m == 1 ? 1e-7
                                                                      : 1e-10)
        << "method " << m;  // L-BFGS stops when losses only differ by rounding
    EXPECT_GT((x - clipped(free)).norm(), 0.1) << "the bounds would not matter";
    if (m == 0 || m == 2) EXPECT_EQ(results[m].reason, StopReason::gradient_zero) << m;
  }
}

/// The result of L-BFGS, and the number of evaluations until the loss was within the tolerance of the minimum; -1:
/// never. L-BFGS-B (SciPy 1.17.1, 10 pairs, the same initial values) needs 4, 35 and 193 for Rosenbrock's function, 47
/// for the bowl.
struct Found {
  OptimiseResult result;
  int evaluations = -1;
};
Found find_within(const Objective& objective, const VectorXd& start, double low, double high, double minimum,
                  double tolerance) {
  int made = 0;
  Found found;
  const Objective counted = [&](const VectorXd& x, VectorXd& gradient) {
    const double loss = objective(x, gradient);
    ++made;
    if (found.evaluations < 0 && loss <= minimum + tolerance * (1 + minimum)) found.evaluations = made;
    return loss;
  };
  const Bounds bounds{VectorXd::Constant(start.size(), low), VectorXd::Constant(start.size(), high)};
  found.result = minimise(Lbfgs{}, counted, start, 5000, {}, 1e-10, bounds);
  return found;
}

/// Rosenbrock's function with x <= 0.8: in two dimensions the minimum 0.04 is at (0.8, 0.64); the others were computed
/// by SciPy with two methods.
TEST(Bounds, LbfgsOnRosenbrockWithinABox) {
  struct Case {
    int size;
    double minimum;
    int most;
  };
  for (const auto& [size, minimum, most] :
       {Case{2, 0.04, 60}, Case{10, 6.001016394606179, 70}, Case{50, 45.596891356878785, 193}}) {
    const Found found = find_within(rosenbrock, VectorXd::Constant(size, -1.2), -2, 0.8, minimum, 1e-8);
    EXPECT_NEAR(found.result.loss, minimum, 1e-9 * minimum) << size;
    EXPECT_EQ(found.result.x[0], 0.8);
    EXPECT_GT(found.evaluations, 0) << size;
    EXPECT_LE(found.evaluations, most) << size;
    EXPECT_LE(found.result.evaluations, 2 * most) << size;  // it recognises convergence
  }
}

/// Weights from 1 to 1e4, minimisers below, in and above 0 .. 1 in turn: two thirds of the bounds are active.
TEST(Bounds, LbfgsOnABadlyScaledBowl) {
  constexpr int size = 20;
  const auto centre = [](Eigen::Index i) { return i % 3 == 0 ? -1.0 : i % 3 == 1 ? 0.3 : 2.0; };
  const auto weight = [](Eigen::Index i) { return std::pow(1e4, static_cast<double>(i) / (size - 1)); };
  const Objective objective = [&](const VectorXd& x, VectorXd& gradient) {
    double loss = 0;
    for (Eigen::Index i = 0; i < size; ++i) {
      const double d = x[i] - centre(i);
      loss += 0.5 * weight(i) * d * d;
      gradient[i] = weight(i) * d;
    }
    return loss;
  };
  double minimum = 0;
  for (Eigen::Index i = 0; i < size; ++i) minimum += i % 3 == 1 ? 0 : 0.5 * weight(i);
  const Found found = find_within(objective, VectorXd::Constant(size, 0.5), 0, 1, minimum, 1e-10);
  for (Eigen::Index i = 0; i < size; ++i) EXPECT_NEAR(found.result.x[i], std::clamp(centre(i), 0.0, 1.0), 1e-4) << i;
  EXPECT_GT(found.evaluations, 0);
  EXPECT_LE(found.evaluations, 70);
}

/// The first step, of the gradient's length, is 1e-6 of the required one: it must be lengthened, not repeated.
TEST(Bounds, LbfgsLengthensAFirstStepThatIsTooShort) {
  const Objective flat = [](const VectorXd& x, VectorXd& gradient) {
    gradient = 1e-6 * (x.array() - 0.25).matrix();
    return 0.5e-6 * (x.array() - 0.25).square().sum();
  };
  const OptimiseResult one =
      minimise(Lbfgs{}, flat, VectorXd::Constant(40, 0.9), 1, {}, 0, {VectorXd::Zero(40), VectorXd::Ones(40)});
  EXPECT_LT(one.loss, 1e-3 * one.losses.front());
  EXPECT_LE(one.evaluations, 10);
}

/// Two unknowns of size 1e-6 and 5e4 with equal influence.
double of_two_sizes(const VectorXd& x, VectorXd& gradient) {
  const VectorXd y{{x[0] / 1e-6, x[1] / 5e4}};
  const double loss = rosenbrock(y, gradient);
  gradient[0] /= 1e-6;
  gradient[1] /= 5e4;
  return loss;
}

/// As many iterations as for unknowns of size 1, with and without bounds; a factor of the loss changes nothing.
TEST(Optimise, LbfgsTakesUnknownsByTheirSizes) {
  const OptimiseResult plain = minimise(Lbfgs{}, rosenbrock, VectorXd{{-1.2, 1.0}}, 500, {}, 1e-10);
  const VectorXd start{{-1.2e-6, 5e4}};
  const Bounds bounds{VectorXd{{-3e-6, -1e5}}, VectorXd{{3e-6, 2e5}}};
  for (const double factor : {1.0, 1e-14, 1e10}) {
    const Objective objective = [&](const VectorXd& x, VectorXd& gradient) {
      const double loss = of_two_sizes(x, gradient);
      gradient *= factor;
      return factor * loss;
    };
    for (const Bounds& within : {Bounds{}, bounds}) {
      const std::vector<UnknownScale> scales = scales_of(start, {{0, 1}, {1, 1}}, within);
      const ScaledResult found = minimise_scaled(Lbfgs{}, objective, start, 500, scales, {}, 0, within);
      EXPECT_NEAR(found.result.x[0], 1e-6, 1e-11) << factor;
      EXPECT_NEAR(found.result.x[1], 5e4, 0.5) << factor;
      EXPECT_LT(found.result.evaluations, 3 * plain.evaluations + 40) << factor;
      EXPECT_EQ(found.scales, (std::vector<double>{1.2e-6, 5e4}));
    }
  }
}

/// Scale of an unknown that starts at 0: half the width of its bounds, else from its first slope compared with the
/// others.
TEST(Optimise, ScalesOfUnknownsThatBeginAtZero) {
  const VectorXd start{{0, 5e4}};
  const Bounds bounds{VectorXd{{-3e-6, -INFINITY}}, VectorXd{{3e-6, INFINITY}}};
  EXPECT_DOUBLE_EQ(scales_of(start, {{0, 1}, {1, 1}}, bounds)[0].size, 3e-6);
  EXPECT_TRUE(scales_of(start, {{0, 2}}, {}).empty());
  const std::vector<UnknownScale> scales = scales_of(start, {{0, 1}, {1, 1}}, {});
  EXPECT_EQ(scales[0].size, 0);
  const ScaledResult found = minimise_scaled(Lbfgs{}, of_two_sizes, start, 500, scales);
  EXPECT_NEAR(found.result.x[0], 1e-6, 1e-11);
  EXPECT_NEAR(found.result.x[1], 5e4, 0.5);
  EXPECT_GT(found.scales[0], 0);
}

/// A gradient whose square overflows ends the method: Adam would silently stay in place.
TEST(Optimise, AGradientWithoutANormEndsIt) {
  const Objective steep = [](const VectorXd& x, VectorXd& gradient) {
    gradient[0] = x[0] < 0.5 ? 1e200 : 1;
    return x[0];
  };
  for (const Method::Kind kind : {Method::Kind::adam, Method::Kind::gradient_descent}) {
    const OptimiseResult result = minimise({kind, 0.3}, steep, {}, VectorXd{{1.0}}, 20);
    EXPECT_EQ(result.reason, StopReason::not_finite);
    EXPECT_GE(result.x[0], 0.5);
  }
}

}  // namespace
}  // namespace dpde
