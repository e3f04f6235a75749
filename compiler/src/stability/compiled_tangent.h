// SPDX-License-Identifier: Apache-2.0
// A step's tangent as machine code, for matrices of many columns: a column takes microseconds, where the interpreter
// takes milliseconds. Compiling takes some tenths of a second.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <vector>

#include "codegen/compiled_module.h"
#include "driver/session.h"
#include "model/model.h"
#include "stability/linear_step.h"
#include "stencil/interpret.h"

namespace dpde::stability {

/// Memory for a tangent, with halos as wide as it reads; no field is in it.
stencil::State memory_for(const LinearStep& linear, const stencil::Grid& grid);
/// The scene's own grid.
stencil::Grid grid_of(const std::vector<model::Axis>& axes);
/// Memory with all that is no perturbation, as the scene begins.
stencil::State initial_inputs(driver::Session& session, const LinearStep& linear);

class CompiledTangent {
 public:
  /// null where a method with a tolerance, a transform or a network would run in it, or no code can be made.
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear);
  /// With another body, which lacks what makes fields that `inputs` has.
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear, const stencil::Program& program);
  /// With the means that linear.module() is without, with solves, whatever their method is, and transforms: to see
  /// what grows.
  static std::unique_ptr<CompiledTangent> of_coupled(const LinearStep& linear);

  /// What a step makes of all perturbations, states one behind the other; 0 in rows and columns of states that nothing
  /// depends on. `inputs` has every field that is no perturbation, halos included.
  Eigen::MatrixXd matrix(const stencil::State& inputs, const stencil::Params& params) const;
  static constexpr int steps_between_growths = 8;
  struct Repeated {
    /// ln of what a perturbation is multiplied by from the eighth step up to each eighth, and to the last. In the first
    /// ones noise becomes what states are to one another: those that are rates of others are as fast as these.
    std::vector<double> growths;
    Eigen::MatrixXd last;  // what it has become, of length 1: cells by states that anything depends on
  };
  /// Of a random perturbation; the last growth is infinite where it leaves the range of numbers or a solve finds no
  /// solution. It ends early where ln of the growth is above `enough`.
  Repeated repeated(const stencil::State& inputs, const stencil::Params& params, int steps,
                    double enough = std::numeric_limits<double>::infinity()) const;
  /// Arnoldi's method (Y. Saad, Numerical Methods for Large Eigenvalue Problems, 2011, 6.2): the step on the space of a
  /// perturbation, given as `Repeated` leaves it, and of what up to `most` steps make of it, in an orthonormal basis: a
  /// Hessenberg matrix, whose largest eigenvalues come near those of the step. Smaller than `most` where the space
  /// holds all that steps make; 0 x 0 where a value is not finite or a solve finds no solution.
  Eigen::MatrixXd on_krylov_space(const stencil::State& inputs, const stencil::Params& params,
                                  const Eigen::MatrixXd& perturbation, int most) const;

 private:
  struct Run;
  struct Columns;
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear, const stencil::Module& module, bool with_more);
  CompiledTangent(const LinearStep& linear, std::shared_ptr<codegen::CompiledModule> code)
      : linear_(linear), code_(std::move(code)) {}

  const LinearStep& linear_;
  std::shared_ptr<codegen::CompiledModule> code_;
};

}  // namespace dpde::stability
