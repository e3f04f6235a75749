// SPDX-License-Identifier: Apache-2.0
// A step's tangent as machine code, for matrices of many columns: a column takes microseconds, where the interpreter
// takes milliseconds. Compiling takes some tenths of a second.
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

/// Memory for a tangent, with halos as wide as it reads; no field is in it.
stencil::State memory_for(const LinearStep& linear, const stencil::Grid& grid);
/// The scene's own grid.
stencil::Grid grid_of(const std::vector<model::Axis>& axes);
/// Memory with all that is no perturbation, as the scene begins.
stencil::State initial_inputs(driver::Session& session, const LinearStep& linear);
/// The same with states as one step of this length makes them; nullopt where one is not finite, or a solve in it finds
/// no solution.
std::optional<stencil::State> inputs_after(driver::Session& session, const LinearStep& linear, double step);

class CompiledTangent {
 public:
  /// null where a method with a tolerance, a transform or a network would run in it, or no code can be made.
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear);
  /// With another body, which lacks what makes fields that `inputs` has.
  static std::unique_ptr<CompiledTangent> make(const LinearStep& linear, const stencil::Program& program);
  /// With the means that linear.module() is without, with solves, whatever their method is, and transforms: to see
  /// what grows.
  static std::unique_ptr<CompiledTangent> of_coupled(const LinearStep& linear);

  /// States that anything depends on: columns of perturbations.
  std::vector<std::string> states() const;
  /// What a step makes of all perturbations, states one behind the other; 0 in rows and columns of states that nothing
  /// depends on. `inputs` has every field that is no perturbation, halos included.
  Eigen::MatrixXd matrix(const stencil::State& inputs, const stencil::Params& params) const;
  const LinearStep& linear() const { return linear_; }
  const dpde_program& step() const { return *code_->find(linear_.program().name); }
  /// What a step makes of its inputs alone; nullptr: nothing that it uses later.
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
