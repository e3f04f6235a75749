// SPDX-License-Identifier: Apache-2.0
// Goes back through a step: its adjoint, part by part, and what it adds to the sums. Inside the runtime only.
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

/// In single precision an adjoint adds to sought fields as such over a few steps, in which that is as good as the
/// values are, and then they are added up as doubles.
class SingleTotals {
 public:
  void allocate(const dpde_layout& layout, const std::vector<FieldBar>& totals, RunMemory& memory);
  bool is_used() const { return count_ > 0; }
  void begin();
  void* base(size_t number) const { return pool_.base(static_cast<int64_t>(number)); }
  /// After step n.
  void flush(const BoundAdjoint& adjoint, GradientSums& sums, int n);

 private:
  const dpde_layout* layout_ = nullptr;
  FieldPool pool_;
  int64_t count_ = 0;
  int steps_ = 0;  // that have added to them
};

class StepAdjoint {
 public:
  StepAdjoint(const ResolvedSetup& setup, const StepInputs& inputs, Stepper& stepper, GradientSums& sums,
              AdjointStates& bars, Binder& binder);

  // Preparation
  /// Another one takes its place; the memory of both is not held at a time.
  void replace(const dpde_program& program, Binder& binder, RunMemory& memory);
  void replace_by_kept(int steps, Binder& binder, RunMemory& memory);
  void allocate(RunMemory& memory);
  /// So many states between the parts of a step may be stored.
  void set_part_slots(int slots) { part_slots_ = slots; }

  BoundProgram& program() { return bound_->program; }
  const BoundAdjoint& bound() const { return *bound_; }
  /// Null: the step keeps nothing.
  KeptSteps* kept() { return kept_ ? &*kept_ : nullptr; }
  int64_t kept_fields() const { return kept_ ? kept_->fields() : 0; }

  /// Of a gradient that goes back from the end of step `last`.
  void begin(int last);
  /// Of step n, which begins with `state`; `new_seeds`: the losses have written or changed them.
  void reverse(int n, const StateBuffer& state, bool new_seeds);
  /// The halos of seeds that the losses have written or changed.
  void prepare_seeds();
  /// The states and their adjoints. For frames: with results and seeds exchanged.
  void bind(const StateBuffer& state, bool is_exchanged = false);
  /// What the adjoint of step n adds to.
  void bind_totals(int n);
  /// What its last run, that of step n, has found.
  void take(int n);
  /// Whether it adds to the gradient: its sums and fields here, those of weights in the program.
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
  std::optional<KeptSteps> kept_;  // `bound_` reads what it keeps
  SingleTotals singles_;
  bool adds_ = true;
  Reversal part_reversal_;
  int part_slots_ = 1, planned_parts_ = 0;  // how many may be stored; for how many parts the plan is
};

/// While it lives the adjoint of a step is a product alone: nothing is added to the gradient.
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
