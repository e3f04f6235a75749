// SPDX-License-Identifier: Apache-2.0
// What steps of a tangent make of perturbations, one after the other.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "stability/step/compiled_tangent.h"
#include "stencil/interpret/interpret.h"

namespace dpde::stability {

class TangentMemory;

/// The step on a space of perturbations, in an orthonormal basis: a Hessenberg matrix.
struct KrylovSpace {
  Eigen::MatrixXd matrix;
  double rest = 0;        // of what the step makes of the last of the basis, the length that lies outside
  Eigen::MatrixXd basis;  // a column each, states one behind the other
};

class TangentRuns {
 public:
  /// `inputs` has every field that is no perturbation, halos included.
  TangentRuns(std::shared_ptr<const CompiledTangent> tangent, stencil::State inputs);
  ~TangentRuns();
  TangentRuns(TangentRuns&&) noexcept;

  const CompiledTangent& tangent() const { return *tangent_; }
  /// Of the same step about other states.
  TangentRuns about(stencil::State inputs) const { return {tangent_, std::move(inputs)}; }
  const stencil::State& inputs() const { return inputs_; }
  /// From now on with exp(dt L) in the place of a step 1 + dt L: Taylor's polynomial, see coupled_flow.h.
  void follow_flow() { is_flow_ = true; }

  /// What a step makes of a perturbation, cells by states that anything depends on; not a number where a solve finds no
  /// solution.
  Eigen::MatrixXd applied(const stencil::Params& params, Eigen::MatrixXd perturbation) const;
  static constexpr int steps_between_growths = 8;
  struct Repeated {
    /// ln of what a perturbation is multiplied by from the eighth step up to each eighth, and to the last. In the first
    /// ones noise becomes what states are to one another: those that are rates of others are as fast as these.
    std::vector<double> growths;
    Eigen::MatrixXd last;       // what it has become, of length 1: cells by states that anything depends on
    Eigen::MatrixXd kept;       // what it was after `kept_steps`
    std::string unsolved = {};  // what a solve said that found no solution; "": all did
  };
  /// Of a random perturbation; the last growth is infinite where it leaves the range of numbers or a solve finds no
  /// solution. It ends early where ln of the growth is above `enough`. `kept_steps`: a multiple of
  /// steps_between_growths.
  Repeated repeated(const stencil::Params& params, int steps, double enough = std::numeric_limits<double>::infinity(),
                    int kept_steps = 0) const;
  /// Arnoldi's method (Y. Saad, Numerical Methods for Large Eigenvalue Problems, 2011, 6.2): the space of a
  /// perturbation, given as `Repeated` leaves it, and of what up to `most` steps make of it; the largest eigenvalues of
  /// its matrix come near those of the step. Smaller than `most` where the space holds all that steps make; 0 x 0 where
  /// a value is not finite or a solve finds no solution.
  KrylovSpace on_krylov_space(const stencil::Params& params, const Eigen::MatrixXd& perturbation, int most) const;

 private:
  struct Columns;
  /// Memory in which a run of these begins.
  TangentMemory& memory(const stencil::Params& params) const;

  std::shared_ptr<const CompiledTangent> tangent_;
  stencil::State inputs_;
  bool is_flow_ = false;
  mutable std::unique_ptr<TangentMemory> memory_;  // of the last run: a cache
};

}  // namespace dpde::stability
