// SPDX-License-Identifier: Apache-2.0
// Gradient descent and Adam. L-BFGS is in lbfgs.cpp, Newton's method in newton_cg.cpp.
#include "dpde/runtime/optimise.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/unknown_scales.h"
#include "optimise/minimiser.h"

namespace dpde {

std::string describe(StopReason reason) {
  switch (reason) {
    case StopReason::iterations: return "all iterations made";
    case StopReason::gradient_zero: return "the gradient is zero";
    case StopReason::no_progress: return "no step lowers the loss any more";
    case StopReason::not_finite: return "the loss or its gradient is not a finite number";
    case StopReason::observer: return "stopped";
  }
  return "";
}

void Bounds::project(Eigen::VectorXd& x) const {
  if (!empty()) x = x.cwiseMax(low).cwiseMin(high);
}

void Bounds::keep_free(const Eigen::VectorXd& x, const Eigen::VectorXd& gradient, Eigen::VectorXd& v) const {
  for (Eigen::Index i = 0; i < low.size(); ++i) {
    if ((x[i] <= low[i] && gradient[i] > 0) || (x[i] >= high[i] && gradient[i] < 0)) v[i] = 0;
  }
}

std::vector<UnknownScale> scales_of(const Eigen::VectorXd& start, std::vector<UnknownScale> parts,
                                    const Bounds& bounds) {
  if (parts.size() < 2) return {};
  for (UnknownScale& part : parts) {
    const auto of_part = [&](const Eigen::VectorXd& x) { return x.segment(part.first, part.count); };
    const double root = std::sqrt(static_cast<double>(std::max<Eigen::Index>(part.count, 1)));
    part.size = of_part(start).stableNorm() / root;
    if (part.size > 0 || bounds.empty()) continue;
    const double width = 0.5 * (of_part(bounds.high) - of_part(bounds.low)).stableNorm() / root;
    if (std::isfinite(width)) part.size = width;
  }
  return parts;
}

bool Minimiser::evaluate(const Eigen::VectorXd& x, double& loss, Eigen::VectorXd& gradient) {
  loss = objective(x, gradient);
  ++result.evaluations;
  return std::isfinite(loss) && std::isfinite(gradient.squaredNorm());  // all methods use the squared norm
}

bool Minimiser::start(const Eigen::VectorXd& x, double& loss, Eigen::VectorXd& gradient) {
  gradient.resize(x.size());
  best_x = result.x = x;
  const bool finite = evaluate(x, loss, gradient);
  best_loss = result.loss = first_loss = loss;
  return finite;
}

bool Minimiser::visit(const Eigen::VectorXd& x, double loss, const Eigen::VectorXd& gradient, bool finite) {
  result.losses.push_back(loss);
  if (!finite) {
    result.x = best_x;
    result.loss = best_loss;
    return stop(StopReason::not_finite);
  }
  result.x = x;
  result.loss = loss;
  if (!(best_loss <= loss)) {
    best_loss = loss;
    best_x = x;
  }
  Eigen::VectorXd free = gradient;
  bounds.keep_free(x, gradient, free);
  const double norm = free.norm();
  if (observer && !observer({result.iterations, loss, norm, x})) return stop(StopReason::observer);
  if (norm <= gradient_tolerance) return stop(StopReason::gradient_zero);
  if (result.iterations >= iterations) return stop(StopReason::iterations);
  return true;
}

bool Minimiser::is_rounding(double loss, double change, double expected) const {
  constexpr double epsilon = std::numeric_limits<double>::epsilon(), of_residuals = 16 * epsilon;
  const double level = std::max(4 * epsilon * std::abs(loss), of_residuals * of_residuals * std::abs(first_loss));
  return std::abs(change) <= level && std::abs(change - expected) > 0.5 * std::abs(change);
}

bool Minimiser::stop(StopReason reason) {
  result.reason = reason;
  return false;
}

namespace {

/// The loop of the methods with one evaluation for each update. update(x, gradient, k) changes x, k = 1, 2, ...
template <class Update>
OptimiseResult descend(Minimiser& minimiser, Eigen::VectorXd x, const Update& update) {
  Eigen::VectorXd gradient;
  double loss = 0;
  minimiser.bounds.project(x);
  bool finite = minimiser.start(x, loss, gradient);
  while (minimiser.visit(x, loss, gradient, finite)) {
    update(x, gradient, ++minimiser.result.iterations);
    minimiser.bounds.project(x);
    finite = minimiser.evaluate(x, loss, gradient);
  }
  return std::move(minimiser.result);
}

}  // namespace

OptimiseResult minimise(const GradientDescent& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer, double gradient_tolerance, const Bounds& bounds) {
  Minimiser minimiser{objective, observer, iterations, gradient_tolerance, bounds, {}, {}, 0};
  return descend(minimiser, std::move(x),
                 [&](Eigen::VectorXd& at, const Eigen::VectorXd& gradient, int) { at -= method.rate * gradient; });
}

OptimiseResult minimise(const Adam& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer, double gradient_tolerance, const Bounds& bounds) {
  Minimiser minimiser{objective, observer, iterations, gradient_tolerance, bounds, {}, {}, 0};
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(x.size()), square = Eigen::VectorXd::Zero(x.size());
  return descend(minimiser, std::move(x), [&](Eigen::VectorXd& at, const Eigen::VectorXd& gradient, int k) {
    mean = method.beta1 * mean + (1 - method.beta1) * gradient;
    square = method.beta2 * square + (1 - method.beta2) * gradient.cwiseAbs2();
    const double mean_scale = 1 / (1 - std::pow(method.beta1, k)), square_scale = 1 / (1 - std::pow(method.beta2, k));
    at.array() -= method.rate * mean_scale * mean.array() / ((square_scale * square.array()).sqrt() + method.epsilon);
  });
}

OptimiseResult minimise(const Method& method, const Objective& objective, const HessianProduct& hessian,
                        Eigen::VectorXd x, int iterations, const IterationObserver& observer, const Bounds& bounds) {
  switch (method.kind) {
    case Method::Kind::gradient_descent:
      return minimise(GradientDescent{method.rate}, objective, std::move(x), iterations, observer, 0, bounds);
    case Method::Kind::adam:
      return minimise(Adam{method.rate}, objective, std::move(x), iterations, observer, 0, bounds);
    case Method::Kind::newton_cg:
      return minimise(NewtonCg{}, objective, hessian, std::move(x), iterations, observer, 0, bounds);
    case Method::Kind::lbfgs: break;
  }
  return minimise(Lbfgs{}, objective, std::move(x), iterations, observer, 0, bounds);
}

ScaledResult minimise_scaled(const Method& method, const Objective& objective, const HessianProduct& hessian,
                             Eigen::VectorXd x, int iterations, const std::vector<UnknownScale>& scales,
                             const IterationObserver& observer, const Bounds& bounds) {
  if (method.kind == Method::Kind::lbfgs)
    return minimise_scaled(Lbfgs{}, objective, std::move(x), iterations, scales, observer, 0, bounds);
  return {minimise(method, objective, hessian, std::move(x), iterations, observer, bounds), {}};
}

}  // namespace dpde
