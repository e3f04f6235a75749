// SPDX-License-Identifier: Apache-2.0
// The step that stores intermediate fields for its adjoint in place of states; see RolloutSetup::adjoint_variants.
// Inside the runtime only.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "run/binder.h"
#include "run/forward/step_inputs.h"
#include "run/run_memory.h"

namespace dpde {

/// Inputs of the adjoint that the step computes, apart from states: pairs of a field of the step and of the adjoint.
std::vector<std::pair<int, int>> kept_fields(const ResolvedSetup& setup, const dpde_adjoint_variant& variant);

class KeptSteps {
 public:
  KeptSteps(const ResolvedSetup& setup, const dpde_adjoint_variant& variant, const StepInputs& inputs, int steps,
            Binder& binder);
  void allocate(RunMemory& memory) { pool_ = memory.pool(setup_.layout, fields()); }
  /// Ids of these fields.
  std::vector<ValueId> ids() const { return ids_of(kept_); }
  /// Number of fields stored over all steps.
  int64_t fields() const { return int64_t{steps_} * std::ssize(kept_); }
  BoundProgram& program() { return step_.program; }
  /// See Stepper.
  const std::vector<char>& may_be_over() const { return step_.is_over; }

  /// Step n.
  void step(int n, const StateBuffer& from, const StateBuffer& to);
  /// Binds the stored fields of step n to its adjoint.
  void bind(Executor& adjoint, int n) const;

 private:
  std::vector<ValueId> ids_of(const std::vector<std::pair<int, int>>& kept) const;
  void* at(int n, size_t i) const {
    return pool_.base(static_cast<int64_t>(n) * std::ssize(kept_) + static_cast<int64_t>(i));
  }

  const ResolvedSetup& setup_;
  const StepInputs& inputs_;
  int steps_;
  const dpde_program& program_;
  std::vector<std::pair<int, int>> kept_;
  BoundStep step_;
  FieldPool pool_;  // all fields of a step, step by step
};

}  // namespace dpde
