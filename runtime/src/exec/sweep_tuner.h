// SPDX-License-Identifier: Apache-2.0
// Finds the fastest of several equivalent ways to do a sweep on this machine, during normal use: all give bit-identical
// values, so no run is wasted. Inside the runtime only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dpde {

struct SweepChoice {
  int64_t variant = 0;     // 0: the row itself, v: dpde_kernel.variants[v - 1]
  int64_t prefetches = 0;  // 1: prefetches the next row
  int64_t tile = 1;        // 3-D: rows along y
  int64_t planes = 1;      // 3-D: planes along z that are done together
  bool operator==(const SweepChoice&) const = default;
};

/// Each move (one value of one member) is compared with the best choice so far, alternately, and accepted if its
/// fastest run is clearly faster. A turn is several runs; the first does not count, since the caches are still those of
/// the other choice.
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
  /// The choice for the next run.
  const SweepChoice& choice() const { return is_trial() ? trial_ : best_; }
  /// Reports the time of that run. Not after is_done().
  void took(double seconds);

  /// The best choice, once it is known; "" before.
  std::string text() const;
  /// Sets the choice from text() of the same sweep; returns false and changes nothing if it cannot belong to it.
  bool set(std::string_view text);

 private:
  static constexpr int runs_of_turn = 3;
  bool is_trial() const { return runs_ / runs_of_turn % 2 == 1; }
  void begin_move();

  std::vector<Move> moves_;
  size_t next_ = 0;
  SweepChoice best_, trial_;
  int runs_ = 0;  // of this move, for both choices
  double best_seconds_ = 0, trial_seconds_ = 0;
};

}  // namespace dpde
