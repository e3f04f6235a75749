// SPDX-License-Identifier: Apache-2.0
// A loop of legs, each from one state to the next, gone through backwards by a checkpoint schedule. Inside the runtime
// only.
//
// Buffers are handed around, never copied: to store a state is to keep its buffer. With s slots, s + 1 buffers suffice
// beside that of the first state: the stored states, the current one and the one that the current leg writes.
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
  Reversal() = default;  // of no legs
  /// @throws Error(input) when legs < 0 or slots < 1.
  Reversal(int legs, int slots) : schedule_(legs, slots), slots_(static_cast<std::size_t>(slots), nullptr) {
    free_.reserve(slots_.size() + 2);
  }

  /// From `first`, the state 0, which stays where it is. `advance(leg, from, to)` makes the state leg + 1 of the state
  /// leg, `reverse(leg, state)` is called for the last leg first, with the state that it begins with; both say whether
  /// to go on. `buffer(i)` is the i-th of the buffers, which are asked for one after the other.
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

  /// One that holds no state, until the next leg.
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
  /// What lay there is a state behind those that are still to be reversed.
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
  int made_ = 0;         // buffers that have been asked for
  std::size_t top_ = 0;  // the slot that was stored or restored last
  const StateBuffer* current_ = nullptr;
};

}  // namespace dpde
