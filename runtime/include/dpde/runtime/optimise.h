// SPDX-License-Identifier: Apache-2.0
// Minimisers over a flat vector of unknowns. Deterministic: equal inputs give equal iterates.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <functional>
#include <vector>

#include "dpde/runtime/progress.h"

namespace dpde {

/// Returns the loss at x and sets gradient (already resized to x).
using Objective = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

/// Sets product (already resized to x) to H(x)*v, with the Hessian H or its approximation.
using HessianProduct =
    std::function<void(const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& product)>;

/// low <= x <= high in every component; empty vectors: no bounds.
struct Bounds {
  Eigen::VectorXd low, high;
  bool empty() const { return low.size() == 0; }
  /// Projects x onto the bounds.
  void project(Eigen::VectorXd& x) const;
  /// Sets components of `v` to 0 if x is at their bound and -gradient points outwards: they are not free to move.
  void keep_free(const Eigen::VectorXd& x, const Eigen::VectorXd& gradient, Eigen::VectorXd& v) const;
};

/// Argument of an observer: before update `iteration` (0, 1, ...), and once more after the last update.
struct Iteration {
  int iteration;
  double loss;
  double gradient_norm;  // of the components that are free to move
  const Eigen::VectorXd& x;
};
/// Returns false to stop. May be empty.
using IterationObserver = std::function<bool(const Iteration&)>;

struct OptimiseResult {
  Eigen::VectorXd x;           // after the last update; the best one evaluated if the reason is not_finite
  double loss = 0;             // at x
  std::vector<double> losses;  // entry k: the loss before update k; one entry more than updates were made
  StopReason reason = StopReason::iterations;
  int iterations = 0;        // updates made
  int evaluations = 0;       // calls of the objective
  int hessian_products = 0;  // calls of the Hessian's product (Newton)
};

struct GradientDescent {
  double rate = 0.1;
};
struct Adam {
  double rate = 1e-3, beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
};
struct Lbfgs {
  int memory = 10;
};
struct NewtonCg {
  double first_radius = 0;     // initial radius of the trust region; 0: ten times the size of x, at least 10
  int inner_iterations = 100;  // largest number of Hessian products in an iteration
};

/// Makes up to `iterations` updates from x, each projected onto the bounds. Stops once the gradient's norm is <=
/// gradient_tolerance.
OptimiseResult minimise(const GradientDescent& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer = {}, double gradient_tolerance = 0,
                        const Bounds& bounds = {});
OptimiseResult minimise(const Adam& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer = {}, double gradient_tolerance = 0,
                        const Bounds& bounds = {});
/// Limited-memory BFGS with a strong-Wolfe line search; a loss that is not finite during the search shortens the step.
/// With bounds: acts on the free components along the projected path; shortens the step until the loss has decreased
/// enough (Armijo), lengthens it while the slope is as steep as at the start. Stops with no_progress once the gradient
/// no longer halves and changes of the loss are rounding: below 4 units in its last place, or below (16 units)^2 of the
/// first loss (the rounding of a sum of squares whose residuals were as large as the first ones).
OptimiseResult minimise(const Lbfgs& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer = {}, double gradient_tolerance = 0,
                        const Bounds& bounds = {});

/// Everything that the next iteration of L-BFGS depends on: a stored state continues exactly where it stopped.
struct LbfgsState {
  struct Pair {
    Eigen::VectorXd step, change;  // of x and of the gradient
    double rho = 0;                // 1/(step, change)
  };
  Eigen::VectorXd x, gradient;
  double loss = 0;
  std::deque<Pair> pairs;
};
/// Everything that the next iteration of Newton's method depends on.
struct NewtonCgState {
  Eigen::VectorXd x, gradient;
  double loss = 0;
  double first_norm = 0;  // first gradient's norm; as later norms fall below it, steps are solved more exactly
  double radius = 0;      // of the trust region; 0: not set before the first step
};
/// Makes one iteration from a state whose loss and gradient belong to x. Returns false and restores x if no step lowers
/// the loss.
bool iterate(const NewtonCg& method, NewtonCgState& state, const Objective& objective, const HessianProduct& hessian,
             const Bounds& bounds = {});

/// Newton's method: each step by conjugate gradients on the free components within a trust region (Steihaug). The
/// Hessian may be indefinite.
OptimiseResult minimise(const NewtonCg& method, const Objective& objective, const HessianProduct& hessian,
                        Eigen::VectorXd x, int iterations, const IterationObserver& observer = {},
                        double gradient_tolerance = 0, const Bounds& bounds = {});

/// The method that a task chooses.
struct Method {
  enum class Kind { gradient_descent, adam, lbfgs, newton_cg } kind = Kind::lbfgs;
  double rate = 0;  // of gradient_descent and adam
};
/// Only newton_cg calls `hessian`.
OptimiseResult minimise(const Method& method, const Objective& objective, const HessianProduct& hessian,
                        Eigen::VectorXd x, int iterations, const IterationObserver& observer = {},
                        const Bounds& bounds = {});

}  // namespace dpde
