// SPDX-License-Identifier: Apache-2.0
// First-order minimisers over a flat vector of unknowns. Deterministic: equal inputs give equal iterates.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

namespace dpde {

/// Returns the loss at x and sets gradient (already of the size of x).
using Objective = std::function<double(const Eigen::VectorXd& x, Eigen::VectorXd& gradient)>;

/// What an observer sees: before update `iteration` (0, 1, ...), and once more after the last update.
struct Iteration {
  int iteration;
  double loss;
  double gradient_norm;
  const Eigen::VectorXd& x;
};
/// Returns false to stop. May be empty.
using IterationObserver = std::function<bool(const Iteration&)>;

enum class StopReason {
  iterations,       // all wanted updates were made
  gradient_zero,    // the gradient's norm is below the tolerance
  no_progress,      // L-BFGS: no step along the direction lowers the loss any more
  not_finite,       // the loss or the gradient is not a finite number
  observer,         // the observer said so
};
std::string describe(StopReason reason);

struct OptimiseResult {
  Eigen::VectorXd x;          // after the last update; the best seen when the reason is not_finite
  double loss = 0;            // at x
  std::vector<double> losses; // entry k: the loss before update k; one entry more than updates were made
  StopReason reason = StopReason::iterations;
  int iterations = 0;         // updates made
  int evaluations = 0;        // calls of the objective
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

/// Makes up to `iterations` updates from x. Stops when the gradient's norm is <= gradient_tolerance.
OptimiseResult minimise(const GradientDescent& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer = {}, double gradient_tolerance = 0);
OptimiseResult minimise(const Adam& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer = {}, double gradient_tolerance = 0);
/// Limited-memory BFGS with a strong-Wolfe line search; a loss that is not finite during the search shortens the step.
OptimiseResult minimise(const Lbfgs& method, const Objective& objective, Eigen::VectorXd x, int iterations,
                        const IterationObserver& observer = {}, double gradient_tolerance = 0);

}  // namespace dpde
