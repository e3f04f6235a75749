// SPDX-License-Identifier: Apache-2.0
// Ranks publish pointers to their values, meet, read those of others, and meet again before they write.
#include "dpde/runtime/thread_ranks.h"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "dpde/runtime/error.h"

namespace dpde {
namespace {

[[noreturn]] void not_the_same_calls() {
  throw Error(ErrorKind::run, "the ranks of a divided grid do not make the same calls");
}

/// A barrier for `count` threads that can be cancelled by an error.
class Meeting {
 public:
  explicit Meeting(std::size_t count) : count_(count) {}

  void wait() {
    std::unique_lock lock(mutex_);
    if (++arrived_ == count_) {
      arrived_ = 0;
      ++round_;
      all_are_there_.notify_all();
      return;
    }
    const std::size_t round = round_;
    all_are_there_.wait(lock, [&] { return round_ != round || has_left_; });
    if (round_ == round) not_the_same_calls();
  }

  /// Cancels the barrier for current and later waits. The first error counts: others follow from it.
  void leave(const std::exception_ptr& why) {
    const std::scoped_lock lock(mutex_);
    if (error_ == nullptr) error_ = why;
    has_left_ = true;
    all_are_there_.notify_all();
  }

  const std::exception_ptr& error() const { return error_; }

 private:
  std::mutex mutex_;
  std::condition_variable all_are_there_;
  std::size_t count_, arrived_ = 0, round_ = 0;
  bool has_left_ = false;
  std::exception_ptr error_;
};

/// Pointers that a rank publishes.
struct Shown {
  SidesOf<std::span<const std::byte>> slabs;
  std::span<const double> values;
};

class ThreadRank : public Communicator {
 public:
  ThreadRank(const std::array<int64_t, 3>& ranks, const std::array<int64_t, 3>& place, std::vector<Shown>& shown,
             Meeting& meeting)
      : Communicator(ranks, place), shown_(shown), meeting_(meeting) {}

  void exchange(std::size_t axis, const SidesOf<std::span<const std::byte>>& to,
                const SidesOf<std::span<std::byte>>& from) override {
    own().slabs = to;
    meeting_.wait();
    const bool low_fits = take(from.low, neighbour(axis, -1).slabs.high);
    const bool high_fits = take(from.high, neighbour(axis, 1).slabs.low);
    meeting_.wait();  // until then others read the values of this rank
    if (!low_fits || !high_fits) not_the_same_calls();
  }

  void sum(std::span<double> values, const Axes& over) override {
    combine(values, over, [](double a, double b) { return a + b; });
  }

  void largest(std::span<double> values, const Axes& over) override {
    combine(values, over, [](double a, double b) { return b > a || std::isnan(b) ? b : a; });
  }

 private:
  Shown& of(const std::array<int64_t, 3>& place) {
    return shown_[static_cast<std::size_t>((place[2] * ranks()[1] + place[1]) * ranks()[0] + place[0])];
  }
  Shown& own() { return of(place()); }
  Shown& neighbour(std::size_t axis, int64_t way) {
    std::array<int64_t, 3> there = place();
    there[axis] = (there[axis] + way + ranks()[axis]) % ranks()[axis];
    return of(there);
  }
  /// Returns false and copies nothing if sizes differ.
  static bool take(std::span<std::byte> to, std::span<const std::byte> from) {
    if (to.size() != from.size()) return false;
    std::ranges::copy(from, to.begin());
    return true;
  }

  template <class Combine>
  void combine(std::span<double> values, const Axes& over, const Combine& both) {
    own().values = values;
    meeting_.wait();
    std::array<int64_t, 3> begin = place(), end = place();
    for (std::size_t a = 0; a < 3; ++a) {
      if (over[a]) begin[a] = 0;
      end[a] = over[a] ? ranks()[a] : place()[a] + 1;
    }
    combined_.clear();
    bool fits = true;
    for (int64_t z = begin[2]; z < end[2]; ++z) {
      for (int64_t y = begin[1]; y < end[1]; ++y) {
        for (int64_t x = begin[0]; x < end[0]; ++x) fits = add(of({x, y, z}).values, values.size(), both) && fits;
      }
    }
    meeting_.wait();  // as in exchange()
    if (!fits) not_the_same_calls();
    std::ranges::copy(combined_, values.begin());
  }

  template <class Combine>
  bool add(std::span<const double> values, std::size_t size, const Combine& both) {
    if (values.size() != size) return false;
    if (combined_.empty()) {
      combined_.assign(values.begin(), values.end());
    } else {
      for (std::size_t i = 0; i < size; ++i) combined_[i] = both(combined_[i], values[i]);
    }
    return true;
  }

  std::vector<Shown>& shown_;
  Meeting& meeting_;
  std::vector<double> combined_;
};

}  // namespace

double largest_of(Communicator* ranks, double value) {
  if (ranks != nullptr) ranks->largest({&value, 1});
  return value;
}

void run_ranks(const std::array<int64_t, 3>& ranks, const std::function<void(Communicator& rank)>& f) {
  const auto count = static_cast<std::size_t>(ranks[0] * ranks[1] * ranks[2]);
  std::vector<Shown> shown(count);
  Meeting meeting(count);
  const auto run = [&](std::size_t number) {
    const auto n = static_cast<int64_t>(number);
    try {
      ThreadRank rank(ranks, {n % ranks[0], n / ranks[0] % ranks[1], n / ranks[0] / ranks[1]}, shown, meeting);
      f(rank);
      meeting.leave(nullptr);
    } catch (...) {
      meeting.leave(std::current_exception());
    }
  };
  {
    std::vector<std::jthread> threads;
    try {
      for (std::size_t number = 0; number < count; ++number) threads.emplace_back(run, number);
    } catch (...) {
      meeting.leave(std::current_exception());
    }
  }
  if (meeting.error() != nullptr) std::rethrow_exception(meeting.error());
}

}  // namespace dpde
