// SPDX-License-Identifier: Apache-2.0
// Which of several equal ways to do a sweep is fastest on this machine, found while the sweep is used: all of them give
// the same values to the last bit, so no run is lost. Inside the runtime only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dpde {

struct SweepChoice {
  int64_t variant = 0;     // 0: the row itself, v: dpde_kernel.variants[v - 1]
  int64_t prefetches = 0;  // 1: the next row is fetched while one is computed
  int64_t tile = 1;        // rows along y, 3-D
  int64_t planes = 1;      // along z that are done together, 3-D
  bool operator==(const SweepChoice&) const = default;
};

/// Each move (one value of one member) is tried against the best choice so far, both in turn, and taken when the
/// fastest of its runs is clearly the faster. A turn is several runs, the first of which does not count: its data lie
/// where the other choice left them, in the caches or past them.
class SweepTuner {
 public:
  struct Move {
    int64_t SweepChoice::*member;
    int64_t value;
  };

  SweepTuner() = default;
  SweepTuner(const SweepChoice& first, std::vector<Move> moves)
      : moves_(std::move(moves)), best_(first), trial_(first) {
    begin_move();
  }

  bool has_choice() const { return !moves_.empty(); }
  bool is_done() const { return next_ == moves_.size(); }
  /// For the next run.
  const SweepChoice& choice() const { return is_trial() ? trial_ : best_; }
  /// How long that run took. Not after is_done().
  void took(double seconds);

  /// The best choice, once it is known; "" before.
  std::string text() const;
  /// What text() said of the same sweep; false, and nothing changed, when this can be no choice of it.
  bool set(std::string_view text);

 private:
  static constexpr int runs_of_turn = 3;
  bool is_trial() const { return runs_ / runs_of_turn % 2 == 1; }
  void begin_move();

  std::vector<Move> moves_;
  size_t next_ = 0;
  SweepChoice best_, trial_;
  int runs_ = 0;  // of this move, both choices
  double best_seconds_ = 0, trial_seconds_ = 0;
};

}  // namespace dpde
