// SPDX-License-Identifier: Apache-2.0
// When to store and when to recompute: the binomial (Revolve) schedule that reverses a loop over steps.
//
// State i is the state after i steps; step i leads from state i to state i + 1. With `slots` stored states, the one of
// state 0 included, the plan reverses steps - 1, ..., 0 with the least possible number of forward steps.
#pragma once

#include <cstdint>
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

/// Actions in order; the first stores state 0 in slot 0. steps >= 0; slots >= 1 (more than steps are never used).
/// The forward step steps - 1, whose result the reversal starts with, is not in the plan: whoever executes the first
/// `reverse` runs it before (it overwrites no stored state).
/// @throws Error(input) when steps < 0 or slots < 1.
std::vector<Action> plan(int steps, int slots);

/// Steps that `plan` advances: steps - 1 when nothing is recomputed. Closed form, no plan is made.
int64_t advanced_steps(int steps, int slots);

/// How many slots to use when slots and the two working states may together take `memory_bytes`: 1 .. max(1, steps - 1).
/// @throws Error(input) when less than four states of `state_bytes` fit.
int slots_for(int64_t memory_bytes, int64_t state_bytes, int steps);

}  // namespace dpde::checkpoint
