// SPDX-License-Identifier: Apache-2.0
// The losses of a rollout: which counts at which state, and what they and the averages that they are made of come to.
// Inside the runtime only.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/rollout.h"
#include "run/binder.h"
#include "run/forward/step_inputs.h"
#include "run/states.h"

namespace dpde {

/// Loss `term`, with its data of `entry`, counts at state `step`.
struct LossEvent {
  int step;
  size_t term, entry;
};

/// Keeps a state that is far above where the run began, which the way back may write over.
class FarLook {
 public:
  explicit FarLook(const RolloutSetup& setup) : layout_(setup.layout), ranks_(setup.ranks) {}
  void begin() { found_.reset(); }
  const FarState* found() const { return found_ ? &*found_ : nullptr; }
  /// At state k, at the time t, with its `loss`: that, and no number where the state has grown beyond reason.
  double look(const StateBuffer& first, int k, double t, const StateBuffer& state, double loss);

 private:
  double magnitude(const void* base) const;

  const dpde_layout& layout_;
  Communicator* const ranks_;
  std::optional<FarState> found_;
  std::vector<Field> fields_;  // its memory, once there is one
};

/// Steps are asked for one after the other, in either direction: the place in the list is kept, nothing is searched.
class LossEvents {
 public:
  explicit LossEvents(const std::vector<LossTerm>& losses);
  /// The last step with a loss: gradients run so far.
  int last() const { return events_.empty() ? 0 : events_.back().step; }
  std::span<const LossEvent> at(int k);
  const std::vector<LossEvent>& all() const { return events_; }
  /// The first step behind n, of those before the last, with a loss.
  int next_after(int n) const { return std::ranges::upper_bound(events_, n, {}, &LossEvent::step)->step; }

 private:
  std::vector<LossEvent> events_;  // in order of their steps; not a list over all steps, of which there may be 1e9
  size_t next_ = 0;                // of those at or behind the step that was asked for last
};

class Losses {
 public:
  Losses(const ResolvedSetup& setup, const StepInputs& inputs, const States& states)
      : setup_(setup),
        inputs_(inputs),
        states_(states),
        events_(setup.losses),
        averages_(setup.average_count()),
        far_(setup) {}
  void bind(Binder& binder);

  int last() const { return events_.last(); }
  std::span<const LossEvent> at(int k) { return events_.at(k); }
  bool has(int k) { return !events_.at(k).empty(); }
  const LossEvents& events() const { return events_; }
  std::vector<BoundTerm>& terms() { return terms_; }
  const std::vector<BoundTerm>& terms() const { return terms_; }

  void forget_far_state() { far_.begin(); }
  void begin();
  double value() const { return value_; }
  void lose() { value_ = std::numeric_limits<double>::quiet_NaN(); }
  const FarState* far_state() const { return far_.found(); }
  void add(int k, const StateBuffer& state) { add(at(k), k, state); }
  /// Those of `due` at the state k, which is `state`.
  void add(std::span<const LossEvent> due, int k, const StateBuffer& state);

  /// `take` gets what the adjoint of each loss of averages has found.
  void derive_averages(const std::function<void(std::span<const double> sums, const BoundLossAdjoint&)>& take);
  /// What a loss of averages changes with one of them; nothing where it is none.
  void add_to_average(ValueId id, double bar);
  /// Before the way back: their adjoints are weighed with that.
  void weigh_averages();

 private:
  /// What a run's states add up to, and what the losses that are made of it change with it.
  struct Average {
    double value = 0, bar = 0;
  };
  void give_averages(BoundProgram& program);
  void add_losses_of_averages();

  const ResolvedSetup& setup_;
  const StepInputs& inputs_;
  const States& states_;
  LossEvents events_;
  std::vector<BoundTerm> terms_;
  std::vector<Average> averages_;
  double value_ = 0;
  FarLook far_;
};

}  // namespace dpde
