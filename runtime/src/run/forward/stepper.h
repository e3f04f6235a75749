// SPDX-License-Identifier: Apache-2.0
// Makes steps: one, in parts where a Courant number or a tolerance asks for them, or several in one pass over memory.
// Inside the runtime only.
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
  /// What finds the number of parts; null: none does.
  const BoundProgram* rate_program() const { return rate_ ? &rate_->program : nullptr; }
  /// Calls visit(program) for each.
  template <class Visit>
  void for_each_program(const Visit& visit) {
    visit(step_.program);
    if (rate_) visit(rate_->program);
  }

  /// Fills the halos of all that the caller may have changed: steps go on with step n, from `state`.
  void prepare(int n, const StateBuffer& state);
  void bind(const StateBuffer& from, const StateBuffer& to) { step_.bind(from, to); }
  /// Of each state whether a step in one part may be made over it; `to` has the memory of `from` then.
  const std::vector<char>& may_be_over() const { return step_.is_over; }
  /// Step n, in its parts.
  void step(int n, const StateBuffer& from, const StateBuffer& to);
  /// `count` steps, as steps_at_once() said.
  void steps(int n, int count, const StateBuffer& from, const StateBuffer& to);
  /// How many of the steps n .. until - 1 are done in one go.
  int steps_at_once(int n, int until) const;
  int block_steps() const { return block_ ? block_->steps() : 1; }
  /// Steps n, n + 1, ... or, with `adjoint`, their adjoints, from the states before the first one.
  void run_block(Wavefront& block, int n, const StateBuffer& from, std::span<void* const> results,
                 BoundProgram* adjoint = nullptr);

  // Parts
  PartControl& control() { return control_; }
  const PartControl& control() const { return control_; }
  /// Into how many parts step n is split.
  int parts_of(int n, const StateBuffer& state);
  PartOfStep part_at(int n, int part, int parts) const;
  void part_of_step(int n, const PartOfStep& part, const StateBuffer& from, const StateBuffer& to);
  PartStates& part_states() { return part_states_; }
  int64_t parts_made() const { return made_; }
  int64_t parts_refused() const { return refused_; }
  void count_parts_anew() { made_ = refused_ = 0; }
  /// From now on it sees the states between parts, in the floating-point mode of its own; null: nobody does.
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
  std::optional<Wavefront> block_;  // several steps at once
  PartStates part_states_;
  PartControl control_;
  int64_t made_ = 0, refused_ = 0;      // parts
  const Observer* observer_ = nullptr;  // of the run that is being made
  FloatMode host_mode_ = 0;
};

/// While a run goes on, however it ends.
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
