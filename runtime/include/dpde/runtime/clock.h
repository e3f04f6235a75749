// SPDX-License-Identifier: Apache-2.0
// Where the time of gradients goes, for those that ask: two looks at the clock a program and a network, none where
// nobody asks.
#pragma once

#include <chrono>

namespace dpde {

/// Seconds of the runs of a program, added up.
struct RunSeconds {
  double all = 0, networks = 0;  // networks: of these
  double rest() const { return all - networks; }
  RunSeconds& operator+=(const RunSeconds& other) {
    all += other.all;
    networks += other.networks;
    return *this;
  }
};

/// Of the programs of a gradient. Steps that are made again count as steps.
struct GradientSeconds {
  RunSeconds steps, adjoints, losses;  // losses: and their adjoints
  GradientSeconds& operator+=(const GradientSeconds& other) {
    steps += other.steps;
    adjoints += other.adjoints;
    losses += other.losses;
    return *this;
  }
};

/// Adds the time from here to the end of its life; null: does nothing.
class Stopwatch {
 public:
  explicit Stopwatch(double* to) : to_(to) {
    if (to_ != nullptr) start_ = std::chrono::steady_clock::now();
  }
  ~Stopwatch() {
    if (to_ != nullptr) *to_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double* to_;
  std::chrono::steady_clock::time_point start_{};
};

}  // namespace dpde
