// SPDX-License-Identifier: Apache-2.0
// CPU time in seconds; excludes other processes.
#pragma once

#include <ctime>

namespace dpde::driver {

inline double seconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// For the calling thread.
inline double thread_cpu_seconds() { return seconds_of(CLOCK_THREAD_CPUTIME_ID); }
/// For all threads of this process together.
inline double process_cpu_seconds() { return seconds_of(CLOCK_PROCESS_CPUTIME_ID); }

}  // namespace dpde::driver
