// SPDX-License-Identifier: Apache-2.0
// Optional timing of gradients: two readings of the clock for each run of a program and of a network, none if timing is
// off.
#pragma once

#include <chrono>

namespace dpde {

/// Seconds spent in the runs of a program, added up.
struct RunSeconds {
  double all = 0, networks = 0;  // networks: the part of `all` spent in them
  double rest() const { return all - networks; }
  RunSeconds& operator+=(const RunSeconds& other) {
    all += other.all;
    networks += other.networks;
    return *this;
  }
};

/// Seconds of the programs of a gradient. Recomputed steps count as steps.
struct GradientSeconds {
  RunSeconds steps, adjoints, losses;  // losses: with their adjoints
  GradientSeconds& operator+=(const GradientSeconds& other) {
    steps += other.steps;
    adjoints += other.adjoints;
    losses += other.losses;
    return *this;
  }
};

/// Adds its own lifetime to *to; does nothing if `to` is null.
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
