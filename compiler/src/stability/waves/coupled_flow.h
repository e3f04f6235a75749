// SPDX-License-Identifier: Apache-2.0
// What the equations themselves do to perturbations on the scene's own grid, means that tie its cells together
// included: exp(t L), where L are their rates. No step and no method of the scene's is in it. L is that of a step of
// Euler's method, 1 + dt L, and exp(t L) is Taylor's polynomial of degree 8 in parts of t that are no longer than 1
// over the fastest rate. What it leaves out of each, 3e-6 at most, is of the fastest rate alone.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "stability/step/tangent_runs.h"

namespace dpde::stability {

class CoupledFlow {
 public:
  /// null where a step of Euler's method is not 1 + dt L to rounding, as of constraints, of solves with a tolerance and
  /// of steps along the flow; and on grids that are too large for the fastest rate to be found. `numbers`: of a space.
  static std::unique_ptr<CoupledFlow> make(driver::Session& session, const LinearStep& euler,
                                           const stencil::Params& params, double numbers);

  /// 1 over the fastest rate.
  double step() const { return 1 / fastest_; }
  TangentRuns::Repeated repeated(int steps) const { return flow_.repeated(params_, steps); }
  std::vector<std::string> states() const { return flow_.tangent().states(); }
  /// Of a part of this length, from a perturbation whose columns are of these states; others are left out.
  KrylovSpace on_krylov_space(const Eigen::MatrixXd& perturbation, const std::vector<std::string>& states,
                              int most) const;

 private:
  CoupledFlow(TangentRuns euler, const stencil::Params& params, double fastest);

  TangentRuns flow_;
  stencil::Params params_;
  double fastest_;
};

}  // namespace dpde::stability
