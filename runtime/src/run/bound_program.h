// SPDX-License-Identifier: Apache-2.0
// Programs of a rollout, bound. Inside the runtime only.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "base/reversal.h"
#include "dpde/runtime/executor.h"
#include "grid/field_pool.h"
#include "run/value_ids.h"

namespace dpde {

/// The states, and their next values as adjoints know them.
struct StateIds {
  std::vector<ValueId> now, next;
};

/// A program of the rollout: its executor, where the states enter, and what else has to be set before a run.
struct BoundProgram {
  Executor executor;
  int t_param = -1, dt_param = -1;
  std::vector<std::pair<int, size_t>> controls;        // parameter, and number among the rollout's controls
  std::vector<std::pair<int, size_t>> averages;        // parameter, and number among those of the losses
  std::vector<std::pair<int, size_t>> control_fields;  // field, and number among those of the setup
  std::vector<int> states;                             // field of each state; -1 when the program does not read it
  std::vector<int> fill_states;                        // fields of states whose halo the step does not keep filled
  std::vector<int> fill_inputs;                        // fields of the caller
  FieldPool temporaries;

  bool reads_states() const {
    return std::ranges::any_of(states, [](int field) { return field >= 0; });
  }
  void bind_states(const StateBuffer& buffer) {
    for (size_t i = 0; i < states.size(); ++i) {
      if (states[i] >= 0) executor.bind(states[i], buffer[i]);
    }
    for (int field : fill_states) executor.prepare(field);
  }
  void prepare_states() {
    for (int field : states) executor.prepare(field);
  }
  void prepare_inputs() {
    for (int field : fill_inputs) executor.prepare(field);
  }
};

/// A sum <param>_bar of a program and its place among the parameter gradients.
struct ParamBar {
  size_t sum, param;
};

/// The field x_bar of an adjoint, and the number of x among the sought fields.
struct FieldBar {
  int field;
  size_t number;
};

struct BoundStep {
  BoundProgram program;
  std::vector<int> next;      // field of each state's next value
  std::vector<char> is_over;  // of each state: whether that may have the state's memory

  void bind(const StateBuffer& from, const StateBuffer& to) {
    program.bind_states(from);
    for (size_t i = 0; i < to.size(); ++i) program.executor.bind(next[i], to[i]);
  }
};
/// How fast things move at a state: 1/time, in each cell.
struct BoundRate {
  BoundProgram program;
  int field;
};
struct BoundAdjoint {
  BoundProgram program;
  std::vector<int> seeds, results;  // fields u_next_bar and u_bar of each state
  std::vector<char> is_over;        // whether these may have the same memory
  std::vector<ParamBar> params;
  std::vector<FieldBar> fields, totals;  // whose values are to be added to what is kept; which the program adds to
  int64_t bytes = 0;                     // of its pools
};
/// Data of a loss: a field and its memory at each entry of at_steps (or the same for all).
struct BoundData {
  int field;
  std::vector<void*> at;
};
struct BoundLoss {
  BoundProgram program;
  int sum = 0;
  std::vector<BoundData> data;
};
struct BoundLossAdjoint {
  BoundProgram program;
  std::vector<int> results;  // field u_bar of each state; -1 when the loss does not depend on it
  std::vector<ParamBar> params;
  std::vector<FieldBar> fields;
  std::vector<BoundData> data;
};
struct BoundTerm {
  double weight;
  BoundLoss loss;
  std::optional<BoundLossAdjoint> adjoint;
  int seed = -1;             // parameter of the adjoint: what the loss weighs
  int average = -1;          // what it adds to in place of the loss
  bool of_averages = false;  // once a run
};

/// @throws Error(run), always.
[[noreturn]] void throw_not_bound(const dpde_program& program, std::string_view what, std::string_view name);

}  // namespace dpde
