// SPDX-License-Identifier: Apache-2.0
// Common parts of all minimisers: counters, history of losses, stopping rules. Inside the runtime only.
#pragma once

#include "dpde/runtime/optimise.h"

namespace dpde {

struct Minimiser {
  const Objective& objective;
  const IterationObserver& observer;
  int iterations;
  double gradient_tolerance;
  const Bounds& bounds;
  OptimiseResult result;
  Eigen::VectorXd best_x;
  double best_loss;
  double first_loss = 0;  // 0: not known

  /// Returns false if the loss, the gradient or its norm is not finite.
  bool evaluate(const Eigen::VectorXd& x, double& loss, Eigen::VectorXd& gradient);
  /// The same for the first evaluation.
  bool start(const Eigen::VectorXd& x, double& loss, Eigen::VectorXd& gradient);
  /// Records an iterate and shows it to the observer; returns false if this was the last one (result is then complete).
  bool visit(const Eigen::VectorXd& x, double loss, const Eigen::VectorXd& gradient, bool finite);
  bool stop(StopReason reason);
  /// True if a change of the loss is rounding: below its last digits, or below the rounding of a sum of squares of
  /// residuals as large as the first ones; and not equal to `expected`, the change by the slopes at both ends. The
  /// slopes keep the method going if the first loss was far too large.
  bool is_rounding(double loss, double change, double expected) const;
};

}  // namespace dpde
