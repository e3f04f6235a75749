// SPDX-License-Identifier: Apache-2.0
// The losses of a rollout: at which states they are evaluated, their values and those of averages. Inside the runtime
// only.
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

/// Loss `term`, with its data of `entry`, is evaluated at state `step`.
struct LossEvent {
  int step;
  size_t term, entry;
};

/// Stores a state that is far above the initial one, since the adjoints may overwrite it.
class FarLook {
 public:
  explicit FarLook(const RolloutSetup& setup) : layout_(setup.layout), ranks_(setup.ranks) {}
  void begin() { found_.reset(); }
  const FarState* found() const { return found_ ? &*found_ : nullptr; }
  /// Checks state k, at time t; returns its `loss`, NaN if the state has grown beyond reason.
  double look(const StateBuffer& first, int k, double t, const StateBuffer& state, double loss);

 private:
  double magnitude(const void* base) const;

  const dpde_layout& layout_;
  Communicator* const ranks_;
  std::optional<FarState> found_;
  std::vector<Field> fields_;  // its memory, allocated on first use
};

/// Steps are queried in order, in either direction: the position in the list is stored, nothing is searched.
class LossEvents {
 public:
  explicit LossEvents(const std::vector<LossTerm>& losses);
  /// The last step with a loss: gradients run to it.
  int last() const { return events_.empty() ? 0 : events_.back().step; }
  std::span<const LossEvent> at(int k);
  const std::vector<LossEvent>& all() const { return events_; }
  /// The first step after n with a loss; n must be before the last one.
  int next_after(int n) const { return std::ranges::upper_bound(events_, n, {}, &LossEvent::step)->step; }

 private:
  std::vector<LossEvent> events_;  // sorted by step; no list over all steps, of which there may be 1e9
  size_t next_ = 0;                // the first event at or after the step of the last query
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
  /// Adds the losses of `due` at state k, which is `state`.
  void add(std::span<const LossEvent> due, int k, const StateBuffer& state);

  /// Calls `take` with the sums of the adjoint of each loss of averages.
  void derive_averages(const std::function<void(std::span<const double> sums, const BoundLossAdjoint&)>& take);
  /// Adds the derivative by an average; does nothing for other values.
  void add_to_average(ValueId id, double bar);
  /// Before the adjoints run: sets the weights of the averages' terms.
  void weigh_averages();

 private:
  /// Sum over a run's states, and derivative of the losses by it.
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
