// SPDX-License-Identifier: Apache-2.0
// Newton's method with a trust region (Nocedal and Wright, Numerical Optimization, algorithms 4.1 and 7.2). Each step
// minimises the quadratic model by conjugate gradients. These stop at the edge of the region, at negative curvature
// (after moving along it to the edge), or if the model's gradient is small enough. At bounds the step is projected.
#include <algorithm>
#include <cmath>
#include <limits>

#include "optimise/minimiser.h"

namespace dpde {
namespace {

constexpr double least_agreement = 1e-4;  // of actual to predicted decrease: below, the step is rejected
constexpr int most_rejections = 40;

/// A step and the decrease of the quadratic model along it.
struct ModelStep {
  Eigen::VectorXd step;
  double decrease = 0;
  bool at_edge = false;
};

/// tau >= 0 with |p + tau d| = radius.
double distance_to_edge(const Eigen::VectorXd& p, const Eigen::VectorXd& d, double radius) {
  const double a = d.squaredNorm(), b = p.dot(d), c = p.squaredNorm() - radius * radius;
  const double root = std::sqrt(std::max(0.0, b * b - a * c));
  return b > 0 ? -c / (b + root) : (root - b) / a;
}

/// Steihaug's method; more exact as the gradient decreases, for superlinear convergence. `product` multiplies by the
/// Hessian at the current point; returns false if it is not finite.
template <class Product>
bool solve(const Eigen::VectorXd& gradient, double first_norm, double radius, int iterations, const Product& product,
           ModelStep& model) {
  const double norm = gradient.norm(), tolerance = std::min(0.1, std::sqrt(norm / first_norm)) * norm;
  model = {Eigen::VectorXd::Zero(gradient.size()), 0, false};
  Eigen::VectorXd residual = gradient, direction = -gradient, image(gradient.size()), step_image = model.step;
  const auto move = [&](double length) {
    model.step += length * direction;
    step_image += length * image;
    model.decrease = -gradient.dot(model.step) - 0.5 * model.step.dot(step_image);
  };
  for (int k = 0; k < iterations; ++k) {
    product(direction, image);
    if (!image.allFinite()) return false;
    const double curvature = direction.dot(image), square = residual.squaredNorm();
    const double length = square / curvature;
    if (!(curvature > 0) || (model.step + length * direction).norm() >= radius) {
      move(distance_to_edge(model.step, direction, radius));
      model.at_edge = true;
      return true;
    }
    move(length);
    residual += length * image;
    if (residual.norm() <= tolerance) return true;
    direction = -residual + (residual.squaredNorm() / square) * direction;
  }
  return true;
}

/// Makes a step that lowers the loss, shrinking the region until there is one.
bool move(const NewtonCg& method, Minimiser& minimiser, NewtonCgState& state, const HessianProduct& hessian) {
  const Bounds& bounds = minimiser.bounds;
  if (state.first_norm == 0) state.first_norm = std::max(state.gradient.norm(), std::numeric_limits<double>::min());
  const auto product = [&](const Eigen::VectorXd& v, Eigen::VectorXd& result) {
    ++minimiser.result.hessian_products;
    hessian(state.x, v, result);
    bounds.keep_free(state.x, state.gradient, result);
  };
  Eigen::VectorXd free = state.gradient, trial_gradient(state.x.size());
  bounds.keep_free(state.x, state.gradient, free);
  for (int rejections = 0; rejections < most_rejections; ++rejections) {
    ModelStep model;
    const double edge = state.radius > 0          ? state.radius
                        : method.first_radius > 0 ? method.first_radius
                                                  : 10 * std::max(1.0, state.x.norm());
    if (!solve(free, state.first_norm, edge, method.inner_iterations, product, model) || !(model.decrease > 0))
      return false;
    Eigen::VectorXd trial = state.x + model.step;
    bounds.project(trial);
    double trial_loss = 0;
    const bool good = minimiser.evaluate(trial, trial_loss, trial_gradient);
    const double agreement = good ? (state.loss - trial_loss) / model.decrease : -1;
    // If both decreases are rounding their ratio is meaningless: a step that lowers the gradient is accepted.
    const bool rounding =
        good && model.decrease <= 1e-14 * std::abs(state.loss) && trial_gradient.norm() < state.gradient.norm();
    if (agreement < 0.25 && !rounding) {
      state.radius = 0.25 * model.step.norm();
    } else if (agreement > 0.75 && model.at_edge) {
      state.radius = 2 * edge;
    } else {
      state.radius = edge;
    }
    if (agreement <= least_agreement && !rounding) continue;
    state.x = std::move(trial);
    state.loss = trial_loss;
    state.gradient = std::move(trial_gradient);
    return true;
  }
  return false;
}

}  // namespace

bool iterate(const NewtonCg& method, NewtonCgState& state, const Objective& objective, const HessianProduct& hessian,
             const Bounds& bounds) {
  const IterationObserver nobody;
  Minimiser minimiser{objective, nobody, 1, 0, bounds, {}, {}, 0};
  return move(method, minimiser, state, hessian);
}

OptimiseResult minimise(const NewtonCg& method, const Objective& objective, const HessianProduct& hessian,
                        Eigen::VectorXd x, int iterations, const IterationObserver& observer, double gradient_tolerance,
                        const Bounds& bounds) {
  Minimiser minimiser{objective, observer, iterations, gradient_tolerance, bounds, {}, {}, 0};
  NewtonCgState state;
  state.x = std::move(x);
  bounds.project(state.x);
  const bool finite = minimiser.start(state.x, state.loss, state.gradient);
  while (minimiser.visit(state.x, state.loss, state.gradient, finite)) {
    if (!move(method, minimiser, state, hessian)) {
      minimiser.stop(StopReason::no_progress);
      break;
    }
    ++minimiser.result.iterations;
  }
  return std::move(minimiser.result);
}

}  // namespace dpde
