// SPDX-License-Identifier: Apache-2.0
// Repeated application of a step's tangent to perturbations.
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

/// The step projected on a Krylov space with an orthonormal basis: a Hessenberg matrix.
struct KrylovSpace {
  Eigen::MatrixXd matrix;
  double rest = 0;        // the last subdiagonal entry: norm of the step of the last basis vector outside the space
  Eigen::MatrixXd basis;  // a column per vector, states one after the other
};

class TangentRuns {
 public:
  /// `inputs` has every field except perturbations, with halos.
  TangentRuns(std::shared_ptr<const CompiledTangent> tangent, stencil::State inputs);
  ~TangentRuns();
  TangentRuns(TangentRuns&&) noexcept;

  const CompiledTangent& tangent() const { return *tangent_; }
  /// The same step about other states.
  TangentRuns about(stencil::State inputs) const { return {tangent_, std::move(inputs)}; }
  const stencil::State& inputs() const { return inputs_; }
  /// From now on applies exp(dt L), by Taylor's polynomial, instead of an Euler step 1 + dt L: see coupled_flow.h.
  void follow_flow() { is_flow_ = true; }

  /// The step applied to a perturbation (rows: cells, columns: states of the tangent); NaN if a solve fails.
  Eigen::MatrixXd applied(const stencil::Params& params, Eigen::MatrixXd perturbation) const;
  static constexpr int steps_between_growths = 8;
  struct Repeated {
    /// ln of the growth from step 8 to every eighth step and to the last. The first steps are left out: in them the
    /// ratios between states settle.
    std::vector<double> growths;
    Eigen::MatrixXd last;       // the final perturbation, of norm 1 (rows: cells, columns: states of the tangent)
    Eigen::MatrixXd kept;       // the perturbation after `kept_steps`
    std::string unsolved = {};  // the message of a failed solve; "": none failed
  };
  /// Runs from a random perturbation. The last growth is infinite on overflow or if a solve fails. Ends early once ln
  /// of the growth exceeds `enough`. `kept_steps`: a multiple of steps_between_growths.
  Repeated repeated(const stencil::Params& params, int steps, double enough = std::numeric_limits<double>::infinity(),
                    int kept_steps = 0) const;
  /// Arnoldi's method (Y. Saad, Numerical Methods for Large Eigenvalue Problems, 2011, 6.2): the Krylov space of a
  /// perturbation (in the layout of Repeated::last) of dimension up to `most`. The largest eigenvalues of its matrix
  /// approximate those of the step. Smaller than `most` if the space is invariant; 0 x 0 if a value is not finite or a
  /// solve fails.
  KrylovSpace on_krylov_space(const stencil::Params& params, const Eigen::MatrixXd& perturbation, int most) const;

 private:
  struct Columns;
  /// Memory prepared for a new run.
  TangentMemory& memory(const stencil::Params& params) const;

  std::shared_ptr<const CompiledTangent> tangent_;
  stencil::State inputs_;
  bool is_flow_ = false;
  mutable std::unique_ptr<TangentMemory> memory_;  // of the last run: a cache
};

}  // namespace dpde::stability
