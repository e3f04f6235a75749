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

/// The states, and the names of their next values in adjoints.
struct StateIds {
  std::vector<ValueId> now, next;
};

/// A program of the rollout: its executor, its state fields, and everything else to set before a run.
struct BoundProgram {
  Executor executor;
  int t_param = -1, dt_param = -1;
  std::vector<std::pair<int, size_t>> controls;        // parameter, and index among the rollout's controls
  std::vector<std::pair<int, size_t>> averages;        // parameter, and index among the averages of the losses
  std::vector<std::pair<int, size_t>> control_fields;  // field, and index among the setup's control fields
  std::vector<int> states;                             // field of each state; -1: not read
  std::vector<int> fill_states;                        // fields of states whose halos the step does not keep filled
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

/// A sum <param>_bar of a program and its index among the parameter gradients.
struct ParamBar {
  size_t sum, param;
};

/// The field x_bar of an adjoint, and the index of x among the unknown fields.
struct FieldBar {
  int field;
  size_t number;
};

struct BoundStep {
  BoundProgram program;
  std::vector<int> next;      // field of each state's next value
  std::vector<char> is_over;  // of each state: whether the next value may share its memory

  void bind(const StateBuffer& from, const StateBuffer& to) {
    program.bind_states(from);
    for (size_t i = 0; i < to.size(); ++i) program.executor.bind(next[i], to[i]);
  }
};
/// The rate of change of a state in each cell: 1/time, for the Courant number.
struct BoundRate {
  BoundProgram program;
  int field;
};
struct BoundAdjoint {
  BoundProgram program;
  std::vector<int> seeds, results;  // fields u_next_bar and u_bar of each state
  std::vector<char> is_over;        // whether both may share memory
  std::vector<ParamBar> params;
  std::vector<FieldBar> fields, totals;  // whose values are added to stored sums; to which the program itself adds
  int64_t bytes = 0;                     // of its memory pools
};
/// Data of a loss: a field and its memory at each entry of at_steps (or one for all).
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
  std::vector<int> results;  // field u_bar of each state; -1: the loss does not depend on it
  std::vector<ParamBar> params;
  std::vector<FieldBar> fields;
  std::vector<BoundData> data;
};
struct BoundTerm {
  double weight;
  BoundLoss loss;
  std::optional<BoundLossAdjoint> adjoint;
  int seed = -1;             // parameter of the adjoint: the weight of the loss
  int average = -1;          // index of the average to which it adds, in place of the loss
  bool of_averages = false;  // evaluated once a run
};

/// @throws Error(run), always.
[[noreturn]] void throw_not_bound(const dpde_program& program, std::string_view what, std::string_view name);

}  // namespace dpde
