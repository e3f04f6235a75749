// SPDX-License-Identifier: Apache-2.0
// The adjoint of a step, substep by substep, and its contributions to the sums. Inside the runtime only.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/reversal.h"
#include "run/binder.h"
#include "run/forward/stepper.h"
#include "run/reverse/adjoint_states.h"
#include "run/reverse/gradient_sums.h"
#include "run/reverse/kept_steps.h"

namespace dpde {

/// In single precision an adjoint adds to unknown fields in floats over a few steps, for which that is accurate enough;
/// these sums are then added in doubles.
class SingleTotals {
 public:
  void allocate(const dpde_layout& layout, const std::vector<FieldBar>& totals, RunMemory& memory);
  bool is_used() const { return count_ > 0; }
  void begin();
  void* base(size_t number) const { return pool_.base(static_cast<int64_t>(number)); }
  /// Called after step n.
  void flush(const BoundAdjoint& adjoint, GradientSums& sums, int n);

 private:
  const dpde_layout* layout_ = nullptr;
  FieldPool pool_;
  int64_t count_ = 0;
  int steps_ = 0;  // steps that have been added
};

class StepAdjoint {
 public:
  StepAdjoint(const ResolvedSetup& setup, const StepInputs& inputs, Stepper& stepper, GradientSums& sums,
              AdjointStates& bars, Binder& binder);

  // Preparation
  /// Replaces the adjoint's program; only one of them holds memory at a time.
  void replace(const dpde_program& program, Binder& binder, RunMemory& memory);
  void replace_by_kept(const dpde_adjoint_variant& variant, int steps, Binder& binder, RunMemory& memory);
  void allocate(RunMemory& memory);
  /// Largest number of stored states between the substeps of a step.
  void set_part_slots(int slots) { part_slots_ = slots; }

  BoundProgram& program() { return bound_->program; }
  const BoundAdjoint& bound() const { return *bound_; }
  /// Null: the step stores no intermediate fields.
  KeptSteps* kept() { return kept_ ? &*kept_ : nullptr; }
  int64_t kept_fields() const { return kept_ ? kept_->fields() : 0; }

  /// Starts a gradient that runs backwards from the end of step `last`.
  void begin(int last);
  /// Reverses step n, which starts from `state`; `new_seeds`: the losses have changed the seeds.
  void reverse(int n, const StateBuffer& state, bool new_seeds);
  /// Fills the halos of seeds that the losses have changed.
  void prepare_seeds();
  /// Binds the states and their adjoints. `is_exchanged`, for frames: results and seeds are swapped.
  void bind(const StateBuffer& state, bool is_exchanged = false);
  /// Binds the sums to which the adjoint of step n adds.
  void bind_totals(int n);
  /// Adds the results of its last run, that of step n, to the sums.
  void take(int n);
  /// Whether it adds to the gradient: its sums and fields, and the weights' adjoints in the program.
  void add_to_gradient(bool adds);

 private:
  void reverse_parts(int n, int parts, const StateBuffer& state, bool new_seeds);
  void reverse_part(int n, const PartOfStep& part, const StateBuffer& state, bool new_seeds);

  const ResolvedSetup& setup_;
  const StepInputs& inputs_;
  Stepper& stepper_;
  GradientSums& sums_;
  AdjointStates& bars_;
  std::optional<BoundAdjoint> bound_;
  std::optional<KeptSteps> kept_;  // `bound_` reads the fields that it stores
  SingleTotals singles_;
  bool adds_ = true;
  Reversal part_reversal_;
  int part_slots_ = 1, planned_parts_ = 0;  // how many may be stored; number of substeps in the plan
};

/// While it exists the adjoint of a step only computes a product: nothing is added to the gradient.
class WithoutSums {
 public:
  explicit WithoutSums(StepAdjoint& adjoint) : adjoint_(adjoint) { adjoint_.add_to_gradient(false); }
  ~WithoutSums() { adjoint_.add_to_gradient(true); }
  WithoutSums(const WithoutSums&) = delete;
  WithoutSums& operator=(const WithoutSums&) = delete;

 private:
  StepAdjoint& adjoint_;
};

}  // namespace dpde
