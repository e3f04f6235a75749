// SPDX-License-Identifier: Apache-2.0
// Makes steps: single ones, in substeps if a Courant number or a tolerance requires them, or several in one pass over
// memory. Inside the runtime only.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "dpde/runtime/float_mode.h"
#include "dpde/runtime/rollout.h"
#include "dpde/runtime/unsolved.h"
#include "run/binder.h"
#include "run/forward/part_control.h"
#include "run/forward/step_inputs.h"
#include "run/states.h"
#include "wavefront/wavefront.h"

namespace dpde {

class Stepper {
 public:
  Stepper(const RolloutSetup& setup, const StepInputs& inputs, const States& states, Binder& binder);

  void plan_block();
  BoundProgram& program() { return step_.program; }
  const BoundProgram& program() const { return step_.program; }
  /// The program that determines the number of substeps; null: none.
  const BoundProgram* rate_program() const { return rate_ ? &rate_->program : nullptr; }
  /// Calls visit(program) for each program.
  template <class Visit>
  void for_each_program(const Visit& visit) {
    visit(step_.program);
    if (rate_) visit(rate_->program);
  }

  /// Fills all halos that the caller may have changed; `state` is the one before step n.
  void prepare(int n, const StateBuffer& state);
  void bind(const StateBuffer& from, const StateBuffer& to) { step_.bind(from, to); }
  /// For each state whether an undivided step may overwrite it; `to` then has the memory of `from`.
  const std::vector<char>& may_be_over() const { return step_.is_over; }
  /// Makes step n, with its substeps.
  void step(int n, const StateBuffer& from, const StateBuffer& to);
  /// Makes `count` steps, a number from steps_at_once().
  void steps(int n, int count, const StateBuffer& from, const StateBuffer& to);
  /// How many of the steps n .. until - 1 are done in one pass.
  int steps_at_once(int n, int until) const;
  int block_steps() const { return block_ ? block_->steps() : 1; }
  /// Runs steps n, n + 1, ... from state n or, with `adjoint`, their adjoints.
  void run_block(Wavefront& block, int n, const StateBuffer& from, std::span<void* const> results,
                 BoundProgram* adjoint = nullptr);

  // Substeps
  PartControl& control() { return control_; }
  const PartControl& control() const { return control_; }
  /// Number of substeps of step n.
  int parts_of(int n, const StateBuffer& state);
  PartOfStep part_at(int n, int part, int parts) const;
  void part_of_step(int n, const PartOfStep& part, const StateBuffer& from, const StateBuffer& to);
  PartStates& part_states() { return part_states_; }
  int64_t parts_made() const { return made_; }
  int64_t parts_refused() const { return refused_; }
  void count_parts_anew() { made_ = refused_ = 0; }
  /// Shows the states between substeps to `observer`, in the host's floating-point mode; null: stops this.
  void show_parts(const Observer* observer, FloatMode of_host);

 private:
  void step_under_tolerance(int n, const StateBuffer& from, const StateBuffer& to);
  double estimate_part(int n, const PartOfStep& part, const StateBuffer& from, const StateBuffer& to,
                       std::optional<Unsolved>& unsolved);
  void check_parts(int n, const PartOfStep& next, size_t made, const std::optional<Unsolved>& unsolved) const;
  [[noreturn]] void fail_in_parts(int n, double t, const std::string& why, const char* advice) const;
  void show_part(int n, const PartOfStep& part, const StateBuffer& state) const;
  bool is_finite_state(int n, const StateBuffer& state) const {
    return !states_.find_blow_up(n, inputs_.time(n), state);
  }

  const RolloutSetup& setup_;
  const StepInputs& inputs_;
  const States& states_;
  BoundStep step_;
  std::optional<BoundRate> rate_;
  std::optional<Wavefront> block_;  // several steps in one pass
  PartStates part_states_;
  PartControl control_;
  int64_t made_ = 0, refused_ = 0;      // substeps
  const Observer* observer_ = nullptr;  // of the present run
  FloatMode host_mode_ = 0;
};

/// Shows substeps to an observer until the run ends, also by an exception.
class PartsSeen {
 public:
  PartsSeen(Stepper& stepper, const Observer& observer, FloatMode of_host) : stepper_(stepper) {
    stepper.show_parts(observer.sees_parts && observer.call ? &observer : nullptr, of_host);
  }
  ~PartsSeen() { end(); }
  PartsSeen(const PartsSeen&) = delete;
  PartsSeen& operator=(const PartsSeen&) = delete;
  void end() { stepper_.show_parts(nullptr, 0); }

 private:
  Stepper& stepper_;
};

}  // namespace dpde
