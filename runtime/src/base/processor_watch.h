// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ctime>

#include "dpde/runtime/team.h"

namespace dpde {

/// That a processor has worked for this thread.
inline std::int64_t processor_nanoseconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

/// Adds the seconds that processors work for this thread and, of its team, for it, from here to the end of its life:
/// other programs on the machine do not count.
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
