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

  /// False when the loss or the gradient is not finite.
  bool evaluate(const Eigen::VectorXd& x, double& loss, Eigen::VectorXd& gradient);
  /// The first evaluation.
  bool start(const Eigen::VectorXd& x, double& loss, Eigen::VectorXd& gradient);
  /// Records an iterate, shows it to the observer; false when this was the last one (result is then complete).
  bool visit(const Eigen::VectorXd& x, double loss, const Eigen::VectorXd& gradient, bool finite);
  bool stop(StopReason reason);
};

}  // namespace dpde
