// SPDX-License-Identifier: Apache-2.0
// Runs backwards through a loop of legs, each from one state to the next, by a checkpoint schedule. Inside the runtime
// only.
//
// Buffers change hands, they are never copied: a state is stored by keeping its buffer. With s slots, s + 1 buffers
// suffice besides that of the first state: for the stored states, the current one and the one that the current leg
// writes.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "dpde/runtime/checkpoint.h"

namespace dpde {

/// All states at one time: one base pointer a state.
using StateBuffer = std::vector<void*>;

class Reversal {
 public:
  Reversal() = default;  // a loop without legs
  /// @throws Error(input) if legs < 0 or slots < 1.
  Reversal(int legs, int slots) : schedule_(legs, slots), slots_(static_cast<std::size_t>(slots), nullptr) {
    free_.reserve(slots_.size() + 2);
  }

  /// Reverses the loop from `first`, state 0, which is not moved. `advance(leg, from, to)` computes state leg + 1 from
  /// state leg. `reverse(leg, state)` is called with the initial state of each leg, the last leg first. Both return
  /// false to stop. `buffer(i)` returns the i-th buffer; they are requested in order.
  template <class Buffer, class Advance, class Reverse>
  bool run(const StateBuffer& first, const Buffer& buffer, const Advance& advance, const Reverse& reverse) {
    begin(first);
    while (const std::optional<checkpoint::Action> action = schedule_.next()) {
      switch (action->kind) {
        case checkpoint::ActionKind::advance:
          for (int leg = action->from; leg < action->to; ++leg) {
            const StateBuffer& next = take(buffer);
            if (!advance(leg, *current_, next)) return false;
            leave_current_for(next);
          }
          break;
        case checkpoint::ActionKind::store: store(static_cast<std::size_t>(action->slot)); break;
        case checkpoint::ActionKind::restore: restore(static_cast<std::size_t>(action->slot)); break;
        case checkpoint::ActionKind::reverse:
          if (!reverse(action->from, *current_)) return false;
          break;
      }
    }
    return true;
  }

  /// A buffer that holds no state, until the next leg.
  template <class Buffer>
  const StateBuffer& unused(const Buffer& buffer) {
    free_.push_back(&take(buffer));
    return *free_.back();
  }

 private:
  void begin(const StateBuffer& first) {
    schedule_.rewind();
    slots_.assign(slots_.size(), nullptr);
    free_.clear();
    made_ = 0;
    top_ = 0;
    current_ = &first;
  }
  template <class Buffer>
  const StateBuffer& take(const Buffer& buffer) {
    if (free_.empty()) return buffer(made_++);
    const StateBuffer& last = *free_.back();
    free_.pop_back();
    return last;
  }
  /// The old state of the slot comes after those that are still to be reversed: its buffer is free.
  void store(std::size_t slot) {
    if (slots_[slot] != nullptr) free_.push_back(slots_[slot]);
    slots_[slot] = current_;
    top_ = slot;
  }
  void restore(std::size_t slot) {
    leave_current_for(*slots_[slot]);
    top_ = slot;
  }
  void leave_current_for(const StateBuffer& next) {
    if (current_ != slots_[top_]) free_.push_back(current_);
    current_ = &next;
  }

  checkpoint::Schedule schedule_;
  std::vector<const StateBuffer*> slots_, free_;
  int made_ = 0;         // buffers requested so far
  std::size_t top_ = 0;  // the slot last stored or restored
  const StateBuffer* current_ = nullptr;
};

}  // namespace dpde
