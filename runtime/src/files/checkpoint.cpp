// SPDX-License-Identifier: Apache-2.0
// The binomial schedule. advanced(l, s), the least number of forward steps that reverse l steps from a stored state
// with s slots (that one included), is the solution of
//   advanced(1, s) = 0,  advanced(l, 1) = l (l - 1) / 2,  advanced(l, s) = min over m of m + advanced(l - m, s - 1) +
//   advanced(m, s)
// and has the closed form (Griewank and Walther 2000)  r l - C(s + r, r - 1),  r the least number with C(s + r, s) >=
// l. The minimum lies at any m with advanced' on the same slope in both parts; `split` picks one by the closed form.
#include "dpde/runtime/checkpoint.h"

#include <fmt/format.h>

#include <algorithm>

#include "dpde/runtime/error.h"

namespace dpde::checkpoint {
namespace {

__extension__ using Wide = __int128;
constexpr int64_t far = int64_t{1} << 62;

/// Binomial coefficient C(n, k), limited to `far`.
int64_t binomial(int64_t n, int64_t k) {
  k = std::min(k, n - k);
  if (k < 0) return 0;
  Wide value = 1;
  for (int64_t i = 1; i <= k; ++i) {
    value = value * (n - k + i) / i;
    if (value >= far) return far;
  }
  return static_cast<int64_t>(value);
}

/// Least r with C(slots + r, slots) >= steps: the largest number of times that a step is advanced.
int64_t repetitions(int64_t steps, int64_t slots) {
  int64_t r = 0;
  while (binomial(slots + r, slots) < steps) ++r;
  return r;
}

int64_t advanced(int64_t steps, int64_t slots) {
  if (steps <= 1) return 0;
  if (slots == 1) return steps * (steps - 1) / 2;
  const int64_t r = repetitions(steps, slots);
  return r * steps - binomial(slots + r, r - 1);
}

/// Number of steps from a stored state to the next state to store.
int64_t split(int64_t steps, int64_t slots) {
  const int64_t r = repetitions(steps, slots);
  const int64_t low = steps - binomial(slots - 1 + r, r);  // the rest must not need more than r repetitions
  const int64_t least = binomial(slots + r - 2, slots);    // the first part needs r - 1: between these two
  return std::clamp(std::max(low, least), int64_t{1}, steps - 1);
}

void check(int steps, int slots) {
  if (steps < 0) throw Error(ErrorKind::input, fmt::format("{} steps cannot be reversed", steps));
  if (slots < 1) throw Error(ErrorKind::input, fmt::format("{} checkpoint slots: at least 1 is needed", slots));
}

}  // namespace

Schedule::Schedule(int steps, int slots) : steps_(steps) {
  check(steps, slots);
  last_ = std::min(slots, std::max(steps - 1, 1)) - 1;
  if (steps > 0) stored_.reserve(static_cast<size_t>(last_) + 1);
  rewind();
}

void Schedule::rewind() {
  stored_.clear();
  end_ = steps_;
  count_ = at_ = 0;
  if (steps_ == 0) return;
  stored_.push_back(0);
  add({ActionKind::store, 0, 0, 0});
}

std::optional<Action> Schedule::next() {
  if (at_ == count_) {
    if (stored_.empty()) return std::nullopt;
    count_ = at_ = 0;
    take_turn();
  }
  return turn_[static_cast<size_t>(at_++)];
}

/// Adds the next actions. The current state is stored_.back().
void Schedule::take_turn() {
  const int begin = stored_.back(), slot = static_cast<int>(stored_.size()) - 1;
  if (end_ - begin == 1) {
    add({ActionKind::reverse, begin});
    end_ = begin;
    stored_.pop_back();
    if (!stored_.empty()) add({ActionKind::restore, stored_.back(), 0, slot - 1});
    return;
  }
  const int middle = slot == last_ ? end_ - 1 : begin + static_cast<int>(split(end_ - begin, last_ - slot + 1));
  add({ActionKind::advance, begin, middle});
  if (end_ - middle > 1) {
    add({ActionKind::store, middle, 0, slot + 1});
    stored_.push_back(middle);
    return;
  }
  add({ActionKind::reverse, middle});  // immediately: no slot needed
  add({ActionKind::restore, begin, 0, slot});
  end_ = middle;
}

int64_t advanced_steps(int steps, int slots) {
  check(steps, slots);
  return advanced(steps, std::min(slots, std::max(steps - 1, 1)));
}

int slots_for(int64_t memory_bytes, int64_t state_bytes, int steps) {
  const int64_t states = memory_bytes / std::max<int64_t>(state_bytes, 1);
  if (states < 4) {
    throw Error(ErrorKind::input,
                fmt::format("a checkpoint budget of {} bytes is too small: four states of {} bytes are needed",
                            memory_bytes, state_bytes));
  }
  return static_cast<int>(std::min<int64_t>(states - 2, std::max(steps - 1, 1)));
}

}  // namespace dpde::checkpoint
