// SPDX-License-Identifier: Apache-2.0
// The binomial (Revolve) schedule of storing and recomputing states, which reverses a loop over steps.
//
// State i is the state after i steps; step i leads from state i to state i + 1. With `slots` stored states, the one of
// state 0 included, the plan reverses steps - 1, ..., 0 with the least possible number of forward steps.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace dpde::checkpoint {

enum class ActionKind {
  advance,  // run the steps from .. to - 1: the current state becomes `to`
  store,    // keep the current state (number `from`) in `slot`
  restore,  // the current state becomes that of `slot` (number `from`); the slot keeps it
  reverse,  // the adjoint of step `from`; the current state is `from`
};

struct Action {
  ActionKind kind;
  int from = 0;
  int to = 0;    // advance only
  int slot = 0;  // store and restore only
  bool operator==(const Action&) const = default;
};

/// The actions in order, generated one at a time; memory: one number a slot, for any number of steps. The first action
/// stores state 0 in slot 0. steps >= 0; slots >= 1 (more slots than steps are never used). The forward step steps - 1,
/// whose result the reversal starts from, is not among the actions: the caller runs it before the first `reverse` (it
/// overwrites no stored state).
class Schedule {
 public:
  Schedule() = default;  // a schedule of no steps
  /// @throws Error(input) when steps < 0 or slots < 1.
  Schedule(int steps, int slots);

  /// Returns nothing once all steps are reversed.
  std::optional<Action> next();
  /// Back to the first action; allocates no memory.
  void rewind();

 private:
  void take_turn();
  void add(const Action& action) { turn_[static_cast<std::size_t>(count_++)] = action; }

  int steps_ = 0, last_ = 0;
  int end_ = 0;                   // steps end - 1 .. 0 are still to be reversed
  std::vector<int> stored_;       // entry i: the state in slot i
  std::array<Action, 3> turn_{};  // the actions of this turn
  int count_ = 0, at_ = 0;
};

/// Number of steps that a schedule advances, in closed form; steps - 1 if nothing is recomputed.
int64_t advanced_steps(int steps, int slots);

/// Number of slots for which slots and the two working states together fit in `memory_bytes`: 1 .. max(1, steps - 1).
/// @throws Error(input) when less than four states of `state_bytes` fit.
int slots_for(int64_t memory_bytes, int64_t state_bytes, int steps);

}  // namespace dpde::checkpoint
