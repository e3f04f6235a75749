// SPDX-License-Identifier: Apache-2.0
// The states of a rollout: names, memory, and the check of their values. Inside the runtime only.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "base/reversal.h"
#include "dpde/runtime/rollout.h"
#include "run/bound_program.h"
#include "run/run_memory.h"

namespace dpde {

/// Number of buffers besides that of the initial state. A state with fewer buffers reuses those from the third on in
/// turn, or only the third if steps overwrite the state.
struct BufferPlan {
  int64_t count = 0;
  std::vector<int64_t> of_state;
  std::vector<char> over;
  int64_t fields() const;
};

/// Buffer 0 is the initial state, the others are in a pool.
class States {
 public:
  /// @throws Error(run) if there is no step, or if the trial program has no error estimate.
  States(const ResolvedSetup& setup, RunMemory& memory);
  void allocate(const BufferPlan& plan, RunMemory& memory, const std::string& folder);

  size_t count() const { return ids_.now.size(); }
  const StateIds& ids() const { return ids_; }
  int index_of(ValueId id) const;
  Field& initial(size_t state) { return initial_[state]; }

  const StateBuffer& first() const { return buffers_.front(); }
  const StateBuffer& buffer(int number) const { return buffers_[static_cast<size_t>(number)]; }
  /// The current state.
  const StateBuffer& now() const { return buffer(current_); }
  int current() const { return current_; }
  void go_to(int number) { current_ = number; }
  /// Makes the initial state current and resets all buffers to their allocated memory.
  void go_to_first();
  /// Chooses the memory of buffer `number` for a step from the current state. States that `may_be_over` share the
  /// memory of the current one, unless that is the initial state or `kept`; others get memory that neither of them
  /// uses.
  void place(int number, int kept, const std::vector<char>& may_be_over, bool is_over);
  /// A work buffer that is neither that of the current state nor `kept`.
  int free_buffer(int kept) const;
  int free_buffer() const { return free_buffer(current_); }
  /// Copies the initial state to a separate buffer, which becomes current.
  void copy_first();

  /// The first value that is not finite of state `step`, at time t.
  std::optional<BlowUp> find_blow_up(int step, double t, const StateBuffer& state) const;

 private:
  std::optional<Cell> find_bad_cell(const void* state, double& value) const;

  const dpde_layout& layout_;
  Communicator* const ranks_;
  StateIds ids_;
  std::vector<Field> initial_;
  FieldPool pool_;
  std::vector<StateBuffer> buffers_;
  std::vector<StateBuffer> given_;  // the first ones as allocated: place() changes no others
  int current_ = 0;
};

/// States between substeps, allocated on first use.
class PartStates {
 public:
  PartStates(const dpde_layout& layout, size_t states) : layout_(layout), states_(states) {}
  const StateBuffer& operator[](int number);
  int64_t fields() const { return static_cast<int64_t>(buffers_.size() * states_); }

 private:
  const dpde_layout& layout_;
  size_t states_;
  std::vector<FieldPool> pools_;     // two work buffers and, in gradients, the stored ones
  std::deque<StateBuffer> buffers_;  // a deque keeps addresses of buffers in use
};

}  // namespace dpde
