// SPDX-License-Identifier: Apache-2.0
// Minimisers over a flat vector of unknowns. Deterministic: equal inputs give equal iterates.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <functional>
#include <vector>

#include "dpde/runtime/progress.h"

namespace dpde {

/// Returns the loss at x and sets gradient (already of the size of x).
using Objective = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

/// Sets product (already of the size of x) to the Hessian at x, or what stands for it, times v.
using HessianProduct =
    std::function<void(const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& product)>;

/// low <= x <= high in every component; empty vectors: no bounds.
struct Bounds {
  Eigen::VectorXd low, high;
  bool empty() const { return low.size() == 0; }
  /// The nearest point within.
  void project(Eigen::VectorXd& x) const;
  /// Sets to 0 the components of `v` at whose bounds x lies while `gradient` falls outwards: they stay where they are.
  void keep_free(const Eigen::VectorXd& x, const Eigen::VectorXd& gradient, Eigen::VectorXd& v) const;
};

/// What an observer sees: before update `iteration` (0, 1, ...), and once more after the last update.
struct Iteration {
  int iteration;
  double loss;
  double gradient_norm;  // of the components that are free to move
  const Eigen::VectorXd& x;
};
/// Returns false to stop. May be empty.
using IterationObserver = std::function<bool(const Iteration&)>;

struct OptimiseResult {
  Eigen::VectorXd x;           // after the last update; the best seen when the reason is not_finite
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
  double first_radius = 0;     // of the trust region; 0: ten times the size of x, at least 10
  int inner_iterations = 100;  // at most so many products an iteration
};

/// Makes up to `iterations` updates from x, each projected onto the bounds. Stops when the gradient's norm is <=
/// gradient_tolerance.
OptimiseResult minimise(const GradientDescent& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer = {}, double gradient_tolerance = 0,
                        const Bounds& bounds = {});
OptimiseResult minimise(const Adam& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer = {}, double gradient_tolerance = 0,
                        const Bounds& bounds = {});
/// Limited-memory BFGS with a strong-Wolfe line search; a loss that is not finite during the search shortens the step.
/// With bounds: on the components that are free, along the projected path, shorter until the loss has fallen enough
/// (Armijo) and longer while it falls as steeply as at the start. Stops with no_progress where changes of the loss are
/// rounding: below 4 units of its last place, or below (16 units)^2 of the first loss (what residuals of the first
/// one's size leave of a sum of squares), not what the slopes say, and the gradient no longer halves.
OptimiseResult minimise(const Lbfgs& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer = {}, double gradient_tolerance = 0,
                        const Bounds& bounds = {});

/// All that the next iteration of L-BFGS depends on: what is kept goes on as if it had never stopped.
struct LbfgsState {
  struct Pair {
    Eigen::VectorXd step, change;  // of x and of the gradient
    double rho = 0;                // 1/(step, change)
  };
  Eigen::VectorXd x, gradient;
  double loss = 0;
  std::deque<Pair> pairs;
};
/// All that the next iteration of Newton's method depends on.
struct NewtonCgState {
  Eigen::VectorXd x, gradient;
  double loss = 0;
  double first_norm = 0;  // of the first gradient: the smaller later ones are, the more exactly steps are found
  double radius = 0;      // of the trust region; 0: not known before the first step
};
/// Makes one iteration from a state whose loss and gradient are those at x. False when no step lowers the loss; x is
/// then what it was.
bool iterate(const NewtonCg& method, NewtonCgState& state, const Objective& objective, const HessianProduct& hessian,
             const Bounds& bounds = {});

/// Newton's method, each step by conjugate gradients on the free components within a trust region (Steihaug). The
/// Hessian need not be positive.
OptimiseResult minimise(const NewtonCg& method, const Objective& objective, const HessianProduct& hessian,
                        Eigen::VectorXd x, int iterations, const IterationObserver& observer = {},
                        double gradient_tolerance = 0, const Bounds& bounds = {});

/// One of them, as a task names it.
struct Method {
  enum class Kind { gradient_descent, adam, lbfgs, newton_cg } kind = Kind::lbfgs;
  double rate = 0;  // of gradient_descent and adam
};
/// `hessian` is asked by newton_cg alone.
OptimiseResult minimise(const Method& method, const Objective& objective, const HessianProduct& hessian,
                        Eigen::VectorXd x, int iterations, const IterationObserver& observer = {},
                        const Bounds& bounds = {});

}  // namespace dpde
