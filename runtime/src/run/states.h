// SPDX-License-Identifier: Apache-2.0
// The states of a rollout: which they are, their memory, and the look at their values. Inside the runtime only.
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

/// How many buffers there are beside that of the initial state, and of each state in fewer of them: from the third on
/// the same ones again and again, or the third alone where steps are made over the state.
struct BufferPlan {
  int64_t count = 0;
  std::vector<int64_t> of_state;
  std::vector<char> over;
  int64_t fields() const;
};

/// Buffer 0 is the initial state, the others lie in a pool.
class States {
 public:
  /// @throws Error(run) where there is no step, or the trial estimates nothing.
  States(const ResolvedSetup& setup, RunMemory& memory);
  void allocate(const BufferPlan& plan, RunMemory& memory, const std::string& folder);

  size_t count() const { return ids_.now.size(); }
  const StateIds& ids() const { return ids_; }
  int index_of(ValueId id) const;
  Field& initial(size_t state) { return initial_[state]; }

  const StateBuffer& first() const { return buffers_.front(); }
  const StateBuffer& buffer(int number) const { return buffers_[static_cast<size_t>(number)]; }
  /// Of the current state.
  const StateBuffer& now() const { return buffer(current_); }
  int current() const { return current_; }
  void go_to(int number) { current_ = number; }
  /// To the initial state, all buffers with the memory that they were given.
  void go_to_first();
  /// Chooses the memory in which a step from the current state writes buffer `number`: for states that are `over`
  /// that of the current one, unless this is the initial state or `kept`; else another one than that of both.
  void place(int number, int kept, const std::vector<char>& may_be_over, bool is_over);
  /// A buffer to work in that is neither that of the current state nor `kept`.
  int free_buffer(int kept) const;
  int free_buffer() const { return free_buffer(current_); }
  /// Into a buffer of its own, which is then the current one.
  void copy_first();

  /// The first value of the state `step`, at the time t, that is not finite.
  std::optional<BlowUp> find_blow_up(int step, double t, const StateBuffer& state) const;

 private:
  std::optional<Cell> find_bad_cell(const void* state, double& value) const;

  const dpde_layout& layout_;
  Communicator* const ranks_;
  StateIds ids_;
  std::vector<Field> initial_;
  FieldPool pool_;
  std::vector<StateBuffer> buffers_;
  std::vector<StateBuffer> given_;  // the first ones as they were allocated: place() changes no others
  int current_ = 0;
};

/// States between the parts of a step, made when they are first needed.
class PartStates {
 public:
  PartStates(const dpde_layout& layout, size_t states) : layout_(layout), states_(states) {}
  const StateBuffer& operator[](int number);
  int64_t fields() const { return static_cast<int64_t>(buffers_.size() * states_); }

 private:
  const dpde_layout& layout_;
  size_t states_;
  std::vector<FieldPool> pools_;     // two to work in, and in gradients those that are stored
  std::deque<StateBuffer> buffers_;  // a deque: buffers in use stay where they are
};

}  // namespace dpde
