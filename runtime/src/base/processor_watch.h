// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ctime>

#include "dpde/runtime/team.h"

namespace dpde {

/// Processor time used by this thread.
inline std::int64_t processor_nanoseconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

/// Adds to `to`, over its own lifetime, the processor seconds of this thread and of its team's helpers. Other programs
/// on the machine do not count.
class ProcessorWatch {
 public:
  explicit ProcessorWatch(double& to, const Team& team = 1) : to_(to), team_(team), start_(now()) {}
  ~ProcessorWatch() { to_ += now() - start_; }
  ProcessorWatch(const ProcessorWatch&) = delete;
  ProcessorWatch& operator=(const ProcessorWatch&) = delete;

 private:
  double now() const { return 1e-9 * static_cast<double>(processor_nanoseconds()) + team_.helped_seconds(); }

  double& to_;
  const Team team_;
  double start_;
};

}  // namespace dpde
