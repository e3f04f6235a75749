// SPDX-License-Identifier: Apache-2.0
#include "exec/sweep_tuner.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>

namespace dpde {
namespace {

constexpr int turns = 4;  // for both choices together
constexpr double clearly = 0.97;

/// Parses a number and removes it and the next character from the text.
bool take_number(std::string_view& text, int64_t& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return false;
  text.remove_prefix(std::min(text.size(), static_cast<size_t>(end - text.data()) + 1));
  return true;
}

}  // namespace

void SweepTuner::begin_move() {
  runs_ = 0;
  best_seconds_ = trial_seconds_ = std::numeric_limits<double>::infinity();
  if (is_done()) return;
  trial_ = best_;
  trial_.*moves_[next_].member = moves_[next_].value;
}

void SweepTuner::took(double seconds) {
  double& fastest = is_trial() ? trial_seconds_ : best_seconds_;
  if (runs_ % runs_of_turn != 0) fastest = std::min(fastest, seconds);
  if (++runs_ < turns * runs_of_turn) return;
  if (trial_seconds_ < clearly * best_seconds_) best_ = trial_;
  ++next_;
  begin_move();
}

std::string SweepTuner::text() const {
  return is_done() && has_choice()
             ? fmt::format("{} {} {} {}", best_.variant, best_.prefetches, best_.tile, best_.planes)
             : "";
}

bool SweepTuner::set(std::string_view text) {
  SweepChoice given;
  for (int64_t* member : {&given.variant, &given.prefetches, &given.tile, &given.planes}) {
    if (!take_number(text, *member)) return false;
  }
  for (int64_t SweepChoice::*member :
       {&SweepChoice::variant, &SweepChoice::prefetches, &SweepChoice::tile, &SweepChoice::planes}) {
    const bool is_move = std::ranges::any_of(
        moves_, [&](const Move& move) { return move.member == member && move.value == given.*member; });
    if (given.*member != best_.*member && !is_move) return false;
  }
  best_ = given;
  next_ = moves_.size();
  begin_move();
  return true;
}

}  // namespace dpde
