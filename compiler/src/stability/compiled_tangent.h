// SPDX-License-Identifier: Apache-2.0
// A step's tangent as machine code, for matrices of many columns: a column takes microseconds, where the interpreter
// takes milliseconds. Compiling takes some tenths of a second.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <string>
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

/// The step on a space of perturbations, in an orthonormal basis: a Hessenberg matrix.
struct KrylovSpace {
  Eigen::MatrixXd matrix;
  double rest = 0;  // of what the step makes of the last of the basis, the length that lies outside
};

class CompiledTangent {
 public:
  /// null where a method with a tolerance, a transform or a network would run in it, or no code can be made.
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear);
  /// With another body, which lacks what makes fields that `inputs` has.
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear, const stencil::Program& program);
  /// With the means that linear.module() is without, with solves, whatever their method is, and transforms: to see
  /// what grows.
  static std::unique_ptr<CompiledTangent> of_coupled(const LinearStep& linear);

  /// With exp(dt L) in the place of a step 1 + dt L: Taylor's polynomial, see coupled_flow.h.
  std::unique_ptr<CompiledTangent> flow() const;

  /// States that anything depends on: columns of perturbations.
  std::vector<std::string> states() const;
  /// What a step makes of a perturbation; not a number where a solve finds no solution.
  Eigen::MatrixXd applied(const stencil::State& inputs, const stencil::Params& params,
                          Eigen::MatrixXd perturbation) const;
  /// What a step makes of all perturbations, states one behind the other; 0 in rows and columns of states that nothing
  /// depends on. `inputs` has every field that is no perturbation, halos included.
  Eigen::MatrixXd matrix(const stencil::State& inputs, const stencil::Params& params) const;
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
  Repeated repeated(const stencil::State& inputs, const stencil::Params& params, int steps,
                    double enough = std::numeric_limits<double>::infinity(), int kept_steps = 0) const;
  /// Arnoldi's method (Y. Saad, Numerical Methods for Large Eigenvalue Problems, 2011, 6.2): the space of a
  /// perturbation, given as `Repeated` leaves it, and of what up to `most` steps make of it; the largest eigenvalues of
  /// its matrix come near those of the step. Smaller than `most` where the space holds all that steps make; 0 x 0 where
  /// a value is not finite or a solve finds no solution.
  KrylovSpace on_krylov_space(const stencil::State& inputs, const stencil::Params& params,
                              const Eigen::MatrixXd& perturbation, int most) const;

 private:
  struct Run;
  struct Columns;
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear, const stencil::Module& module, bool with_more);
  CompiledTangent(const LinearStep& linear, std::shared_ptr<codegen::CompiledModule> code, std::string fixed)
      : linear_(linear), code_(std::move(code)), fixed_(std::move(fixed)) {}
  const dpde_program& step() const { return *code_->find(linear_.program().name); }
  /// What a step makes of its inputs alone; nullptr: nothing that it uses later.
  const dpde_program* fixed() const { return fixed_.empty() ? nullptr : code_->find(fixed_); }

  const LinearStep& linear_;
  std::shared_ptr<codegen::CompiledModule> code_;
  std::string fixed_;
  bool is_flow_ = false;
};

}  // namespace dpde::stability
