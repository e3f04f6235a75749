// SPDX-License-Identifier: Apache-2.0
// Reports the progress of a run, a loss or a gradient, and lets the caller stop it. Inside the runtime only.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

#include "dpde/runtime/communicator.h"
#include "dpde/runtime/float_mode.h"
#include "dpde/runtime/rollout.h"

namespace dpde {

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

class RunWatch {
 public:
  explicit RunWatch(const RolloutSetup& setup) : setup_(setup) {}

  void set_callback(GradientCallback call, int every) {
    call_ = std::move(call);
    every_ = std::max(every, 1);
  }
  bool stopping() const {
    return setup_.stop != nullptr && largest_of(setup_.ranks, setup_.stop->load(std::memory_order_relaxed) ? 1 : 0) > 0;
  }

  /// `total`: number of steps. The callback runs in the host's floating-point mode.
  void begin(int64_t total, FloatMode of_host) {
    total_ = total;
    worked_ = 0;
    host_mode_ = of_host;
  }
  /// Counts steps, forward or back, that led to a state at time t; returns false if the callback stops the run.
  bool go_on(double t, int worked, bool is_back) { return count(t, worked, total_, is_back); }
  /// Counts one step of a run of unknown length; the reported total is at least RolloutSetup::steps.
  bool go_on_open(double t, bool is_back) { return count(t, 1, std::max<int64_t>(setup_.steps, worked_ + 2), is_back); }

 private:
  bool count(double t, int worked, int64_t total, bool is_back) {
    const int64_t before = std::exchange(worked_, worked_ + worked);
    if (!call_ || (before / every_ == worked_ / every_ && worked_ != total)) return true;
    const FloatScope of_host(host_mode_);
    return largest_of(setup_.ranks, call_({worked_, total, t, is_back}) ? 0 : 1) == 0;
  }

  const RolloutSetup& setup_;
  GradientCallback call_;
  int every_ = 1;
  FloatMode host_mode_ = 0;
  int64_t total_ = 0, worked_ = 0;  // steps in either direction
};

}  // namespace dpde
