// SPDX-License-Identifier: Apache-2.0
// A step's tangent as machine code, for matrices of many columns: a column takes microseconds, where the interpreter
// takes milliseconds. Compiling takes some tenths of a second.
#pragma once

#include <Eigen/Core>
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
  /// With the means that linear.module() is without, with solves, whatever their method is, and transforms: to see
  /// what grows.
  static std::unique_ptr<CompiledTangent> of_coupled(const LinearStep& linear);

  /// What a step makes of all perturbations, states one behind the other; 0 in rows and columns of states that nothing
  /// depends on. `inputs` has every field that is no perturbation, halos included.
  Eigen::MatrixXd matrix(const stencil::State& inputs, const stencil::Params& params) const;
  static constexpr int steps_between_growths = 8;
  /// ln of what a random perturbation is multiplied by up to each eighth step, and to the last; infinite, and no more
  /// behind it, where it leaves the range of numbers or a solve finds no solution.
  std::vector<double> growths(const stencil::State& inputs, const stencil::Params& params, int steps) const;

 private:
  struct Run;
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear, const stencil::Module& module, bool with_more);
  CompiledTangent(const LinearStep& linear, std::shared_ptr<codegen::CompiledModule> code)
      : linear_(linear), code_(std::move(code)) {}

  const LinearStep& linear_;
  std::shared_ptr<codegen::CompiledModule> code_;
};

}  // namespace dpde::stability
