// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ctime>

namespace dpde {

/// Adds the seconds that a processor works for this thread, from here to the end of its life: other programs on the
/// machine do not count. Solves run on one thread.
class ProcessorWatch {
 public:
  explicit ProcessorWatch(double& to) : to_(to), start_(now()) {}
  ~ProcessorWatch() { to_ += now() - start_; }
  ProcessorWatch(const ProcessorWatch&) = delete;
  ProcessorWatch& operator=(const ProcessorWatch&) = delete;

 private:
  static double now() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  double& to_;
  double start_;
};

}  // namespace dpde
