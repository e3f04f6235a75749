// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/team.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "base/processor_watch.h"
#include "dpde/runtime/float_mode.h"

namespace dpde {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::microseconds;

constexpr auto longest_spin = microseconds(20);  // longer than the gap between the sweeps of a step
constexpr std::int64_t most_units = 60000;       // units a thread: their numbers have 16 bits

inline void pause() {
#if defined(__x86_64__)
  _mm_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// Waits until `value` differs from `old`; returns the new value.
std::uint32_t changed(const std::atomic<std::uint32_t>& value, std::uint32_t old) {
  const auto begin = Clock::now();
  do {
    for (int i = 0; i < 32; ++i) {
      if (const std::uint32_t now = value.load(std::memory_order_acquire); now != old) return now;
      pause();
    }
  } while (Clock::now() - begin < longest_spin);
  value.wait(old, std::memory_order_acquire);
  return value.load(std::memory_order_acquire);
}

/// The units front .. back of work number `epoch` that no thread has begun. The epoch is part of the word, so that a
/// late thread takes no units of later work.
struct UnitRange {
  std::uint32_t epoch, front, back;
  std::uint64_t word() const { return std::uint64_t{epoch} << 32 | std::uint64_t{front} << 16 | back; }
  static UnitRange of(std::uint64_t word) {
    return {static_cast<std::uint32_t>(word >> 32), static_cast<std::uint32_t>(word >> 16 & 0xffff),
            static_cast<std::uint32_t>(word & 0xffff)};
  }
};

}  // namespace

/// The units of one thread, on a cache line of their own.
struct alignas(64) Share {
  std::atomic<std::uint64_t> range{0};

  /// Takes a unit, its owner from the front, others from the back; -1: none are left.
  std::int64_t take(std::uint32_t epoch, bool is_own) {
    std::uint64_t word = range.load(std::memory_order_relaxed);
    for (;;) {
      UnitRange left = UnitRange::of(word);
      if (left.epoch != epoch || left.front == left.back) return -1;
      const std::uint32_t unit = is_own ? left.front++ : --left.back;
      if (range.compare_exchange_weak(word, left.word(), std::memory_order_acq_rel, std::memory_order_relaxed))
        return unit;
    }
  }
};

/// Decides whether several threads are worthwhile. Each work is compared with the time that the caller alone would have
/// needed, extrapolated from the units it did itself. If it took longer and no earlier gain is left, nothing is shared
/// for twenty times the loss, twice as long after each further loss: this limits the loss to one part in twenty. Gains
/// count little: if the caller itself was interrupted, the estimate sees a gain.
class Ledger {
 public:
  bool rests(Clock::time_point now) const { return now < until_; }
  void enter(Clock::time_point now, Clock::duration alone, Clock::duration took) {
    gain_ = std::min<Clock::duration>(gain_ + alone - took, most_gain);
    if (gain_ >= most_gain) rest_ = least_rest;
    if (gain_ >= Clock::duration::zero()) return;
    until_ = now + rest_ * std::max<Clock::duration>(took - alone, microseconds(20));
    rest_ = std::min(2 * rest_, most_rest);
    gain_ = Clock::duration::zero();
  }

 private:
  static constexpr auto most_gain = microseconds(500);
  static constexpr int least_rest = 20, most_rest = 160;
  int rest_ = least_rest;
  Clock::duration gain_ = microseconds(200);
  Clock::time_point until_{};
};

class Team::Crew {
  struct Leave {
    void operator()(std::atomic_flag* flag) const { flag->clear(std::memory_order_release); }
  };

 public:
  explicit Crew(int threads) : shares_(static_cast<std::size_t>(threads)) {}
  ~Crew();

  /// False if the team is busy, or should rest: then the caller works alone.
  bool run(std::int64_t parts, Call call, const void* work);
  double helped_seconds() const { return 1e-9 * static_cast<double>(helped_.load(std::memory_order_relaxed)); }

 private:
  void begin();
  void stay(int thread);
  std::int64_t take_part(int thread, std::uint32_t epoch);
  void do_unit(std::int64_t unit, int thread);
  void deal(std::int64_t units);

  std::atomic_flag at_work_;  // set by the running caller; not a mutex, since a thread of the team may try it again
  bool has_begun_ = false;
  std::vector<std::thread> workers_;
  std::vector<Share> shares_;
  Ledger ledger_;

  // The current work. Late threads also read it, but find no units to take.
  alignas(64) std::atomic<std::uint32_t> epoch_{0};
  std::atomic<bool> ends_{false};
  std::atomic<Call> call_{nullptr};
  std::atomic<const void*> work_{nullptr};
  std::atomic<FloatMode> mode_{0};
  std::atomic<std::int64_t> parts_{0}, units_{0};

  alignas(64) std::atomic<std::uint32_t> unfinished_{0};
  std::atomic<std::int64_t> helped_{0};  // nanoseconds
  std::mutex failing_;
  std::exception_ptr failure_;
  std::int64_t failed_part_ = 0;
};

Team::Crew::~Crew() {
  ends_.store(true, std::memory_order_relaxed);
  epoch_.fetch_add(1, std::memory_order_release);
  epoch_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void Team::Crew::begin() {
  has_begun_ = true;
  try {
    workers_.reserve(shares_.size() - 1);
    while (workers_.size() + 1 < shares_.size())
      workers_.emplace_back([this, thread = static_cast<int>(workers_.size()) + 1] { stay(thread); });
  } catch (const std::system_error&) {  // no more threads: the others take over their shares
  }
}

void Team::Crew::stay(int thread) {
  for (std::uint32_t seen = 0;;) {
    seen = changed(epoch_, seen);
    if (ends_.load(std::memory_order_relaxed)) return;
    const FloatScope of_caller(mode_.load(std::memory_order_relaxed));
    if (thread >= units_.load(std::memory_order_relaxed)) continue;
    const std::int64_t begin = processor_nanoseconds();
    take_part(thread, seen);
    helped_.fetch_add(processor_nanoseconds() - begin, std::memory_order_relaxed);
  }
}

/// Deals the units to all threads, a contiguous range each.
void Team::Crew::deal(std::int64_t units) {
  const auto epoch = epoch_.load(std::memory_order_relaxed) + 1;
  const auto threads = static_cast<std::int64_t>(shares_.size());
  for (std::int64_t t = 0; t < threads; ++t) {
    const std::int64_t count = units * (t + 1) / threads - units * t / threads;
    shares_[static_cast<std::size_t>(t)].range.store(UnitRange{epoch, 0, static_cast<std::uint32_t>(count)}.word(),
                                                     std::memory_order_relaxed);
  }
  epoch_.store(epoch, std::memory_order_release);
  epoch_.notify_all();
}

/// Does its own units, then those that others have not begun; returns how many.
std::int64_t Team::Crew::take_part(int thread, std::uint32_t epoch) {
  const auto threads = static_cast<int>(shares_.size());
  std::int64_t done = 0;
  for (int k = 0; k < threads; ++k) {
    const int of = (thread + k) % threads;
    for (;;) {
      const std::int64_t number = shares_[static_cast<std::size_t>(of)].take(epoch, k == 0);
      if (number < 0) break;
      ++done;
      // This thread holds a unit, so the epoch cannot end before it is done: the values read here belong to it.
      const std::int64_t units = units_.load(std::memory_order_relaxed);
      do_unit(units * of / threads + number, thread);
    }
  }
  return done;
}

void Team::Crew::do_unit(std::int64_t unit, int thread) {
  const Call call = call_.load(std::memory_order_relaxed);
  const void* const work = work_.load(std::memory_order_relaxed);
  const std::int64_t parts = parts_.load(std::memory_order_relaxed), units = units_.load(std::memory_order_relaxed);
  for (std::int64_t part = parts * unit / units, end = parts * (unit + 1) / units; part < end; ++part) {
    try {
      call(work, part, thread);
    } catch (...) {
      const std::lock_guard lock(failing_);
      if (!failure_ || part < failed_part_) {
        failure_ = std::current_exception();
        failed_part_ = part;
      }
    }
  }
  if (unfinished_.fetch_sub(1, std::memory_order_acq_rel) == 1) unfinished_.notify_one();
}

bool Team::Crew::run(std::int64_t parts, Call call, const void* work) {
  if (at_work_.test_and_set(std::memory_order_acquire)) return false;
  const std::unique_ptr<std::atomic_flag, Leave> leave(&at_work_);
  if (!has_begun_) begin();
  const auto start = Clock::now();
  if (ledger_.rests(start)) return false;
  const std::int64_t units = std::min(parts, most_units);
  call_.store(call, std::memory_order_relaxed);
  work_.store(work, std::memory_order_relaxed);
  mode_.store(float_mode(), std::memory_order_relaxed);
  parts_.store(parts, std::memory_order_relaxed);
  units_.store(units, std::memory_order_relaxed);
  unfinished_.store(static_cast<std::uint32_t>(units), std::memory_order_relaxed);
  deal(units);
  const auto dealt = Clock::now();
  const std::int64_t own = take_part(0, epoch_.load(std::memory_order_relaxed));
  auto end = Clock::now();
  const auto alone = own == 0 ? end - start : (end - dealt) * units / own;
  if (std::uint32_t left = unfinished_.load(std::memory_order_acquire); left != 0) {
    while (left != 0) left = changed(unfinished_, left);
    end = Clock::now();
  }
  ledger_.enter(end, alone, end - start);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  return true;
}

Team::Team(int threads)
    : threads_(std::max(threads, 1)), crew_(threads > 1 ? std::make_shared<Crew>(threads) : nullptr) {}

double Team::helped_seconds() const { return crew_ == nullptr ? 0 : crew_->helped_seconds(); }

void Team::share(std::int64_t parts, Call call, const void* work) const {
  if (crew_->run(parts, call, work)) return;
  for (std::int64_t part = 0; part < parts; ++part) call(work, part, 0);
}

}  // namespace dpde
