// SPDX-License-Identifier: Apache-2.0
// What all minimisers share: counting, the history of losses, and when to stop. Inside the runtime only.
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
  double first_loss = 0;  // 0 where it is not known

  /// False when the loss, the gradient or its norm is not finite.
  bool evaluate(const Eigen::VectorXd& x, double& loss, Eigen::VectorXd& gradient);
  /// The first evaluation.
  bool start(const Eigen::VectorXd& x, double& loss, Eigen::VectorXd& gradient);
  /// Records an iterate, shows it to the observer; false when this was the last one (result is then complete).
  bool visit(const Eigen::VectorXd& x, double loss, const Eigen::VectorXd& gradient, bool finite);
  bool stop(StopReason reason);
  /// True where a change of the loss is rounding: less than its last digits, or than what residuals of full size leave
  /// of a sum of squares, and not what the slopes at both ends say (`expected`). The slopes keep losses that began far
  /// too large going.
  bool is_rounding(double loss, double change, double expected) const;
};

}  // namespace dpde
