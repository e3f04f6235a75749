// SPDX-License-Identifier: Apache-2.0
// The linearised equations, exact in time, on the scene's own grid: exp(t L), with means that couple its cells. The
// scene's step and time scheme do not enter. L comes from an Euler step, 1 + dt L. exp(t L) is Taylor's polynomial of
// degree 8 on substeps of at most 1 / fastest rate. Its truncation error is at most 3e-6 a substep, for the fastest
// rate alone.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "stability/step/tangent_runs.h"

namespace dpde::stability {

class CoupledFlow {
 public:
  /// null if an Euler step is not 1 + dt L to rounding, as with constraints, solves with a tolerance and
  /// semi-Lagrangian steps, or if the grid is too large to find the fastest rate. `numbers`: the size of a Krylov
  /// space.
  static std::unique_ptr<CoupledFlow> make(driver::Session& session, const LinearStep& euler,
                                           const stencil::Params& params, double numbers);

  /// 1 / fastest rate.
  double step() const { return 1 / fastest_; }
  TangentRuns::Repeated repeated(int steps) const { return flow_.repeated(params_, steps); }
  std::vector<std::string> states() const { return flow_.tangent().states(); }
  /// The Krylov space of exp(step() L), from a perturbation whose columns belong to `states`; other states start at 0.
  KrylovSpace on_krylov_space(const Eigen::MatrixXd& perturbation, const std::vector<std::string>& states,
                              int most) const;

 private:
  CoupledFlow(TangentRuns euler, const stencil::Params& params, double fastest);

  TangentRuns flow_;
  stencil::Params params_;
  double fastest_;
};

}  // namespace dpde::stability
