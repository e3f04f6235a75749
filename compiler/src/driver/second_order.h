// SPDX-License-Identifier: Apache-2.0
// Products of the Hessian of a task's loss with vectors, by compiled kernels: a run that carries states and rates
// forward through the tangent of the step, and the adjoint of that tangent back, from stored or recomputed states as in
// a gradient.
//
// The adjoint of the tangent gives, for seeds of the rates, both the adjoint of the rates (J^T seeds) and that of the
// states (what the seeds see of the second derivatives). With the tangent of the loss at the end the second is the
// Hessian's product. With the squares of the residuals' rates at the end the first is that of the Gauss-Newton matrix.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>

#include "driver/directions.h"

namespace dpde::driver {

enum class Curvature { full, gauss_newton };

class SecondOrder {
 public:
  /// nullptr when the session was compiled without second derivatives, or (gauss_newton) a loss is not a sum of
  /// squares. Session and inverse must outlive the result.
  static std::unique_ptr<SecondOrder> open(Session& session, Inverse& inverse, Curvature curvature);

  /// `result` has the size of the unknowns. Not a number when the session's stop flag was raised.
  void product(const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result);

 private:
  SecondOrder(Session& session, Inverse& inverse, Curvature curvature, std::unique_ptr<Rollout> rollout)
      : inverse_(inverse), curvature_(curvature), directions_(session, inverse), rollout_(std::move(rollout)) {}

  Inverse& inverse_;
  Curvature curvature_;
  Directions directions_;
  std::unique_ptr<Rollout> rollout_;
  std::vector<const dpde_program*> formulas_;  // adjoints of the tangents of those that hold an unknown
};

}  // namespace dpde::driver
