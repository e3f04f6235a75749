// SPDX-License-Identifier: Apache-2.0
// A step's tangent as machine code, for matrices of many columns: a column takes microseconds instead of the
// interpreter's milliseconds. Compiling takes some tenths of a second.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "codegen/compiled_module.h"
#include "driver/scene/session.h"
#include "model/model.h"
#include "stability/step/linear_step.h"
#include "stencil/interpret/interpret.h"

namespace dpde::stability {

/// Memory for a tangent, with halos as wide as it reads, still without fields.
stencil::State memory_for(const LinearStep& linear, const stencil::Grid& grid);
/// The scene's own grid.
stencil::Grid grid_of(const std::vector<model::Axis>& axes);
/// Memory with all inputs other than perturbations, at the initial state.
stencil::State initial_inputs(driver::Session& session, const LinearStep& linear);
/// The same with the states after one step of this length; nullopt if a state is not finite or a solve fails.
std::optional<stencil::State> inputs_after(driver::Session& session, const LinearStep& linear, double step);

class CompiledTangent {
 public:
  /// null if it would run an iterative solver with a tolerance, a transform or a network, or if no code can be made.
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear);
  /// With another body, without the statements whose results are already in `inputs`.
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear, const stencil::Program& program);
  /// With the means that linear.module() lacks, solves of any method, and transforms: for runs.
  static std::unique_ptr<CompiledTangent> of_coupled(const LinearStep& linear);

  /// The states that the step depends on, in the order of columns.
  std::vector<std::string> states() const;
  /// The matrix of the step, with states one after the other; rows and columns of states that nothing depends on are 0.
  /// `inputs` has every field except perturbations, with halos.
  Eigen::MatrixXd matrix(const stencil::State& inputs, const stencil::Params& params) const;
  const LinearStep& linear() const { return linear_; }
  const dpde_program& step() const { return *code_->find(linear_.program().name); }
  /// The part of a step that depends on inputs alone; nullptr if there is none.
  const dpde_program* fixed() const { return fixed_.empty() ? nullptr : code_->find(fixed_); }

 private:
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear, const stencil::Module& module, bool with_more);
  CompiledTangent(const LinearStep& linear, std::shared_ptr<codegen::CompiledModule> code, std::string fixed)
      : linear_(linear), code_(std::move(code)), fixed_(std::move(fixed)) {}

  const LinearStep& linear_;
  std::shared_ptr<codegen::CompiledModule> code_;
  std::string fixed_;
};

}  // namespace dpde::stability
