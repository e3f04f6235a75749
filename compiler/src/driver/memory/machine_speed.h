// SPDX-License-Identifier: Apache-2.0
// Peak speed of this machine, for a roofline (S. Williams, A. Waterman and D. Patterson, Comm. ACM 52 (2009)). Measured
// once and cached, so that it does not depend on other processes at the time of a command.
#pragma once

#include <string>

#include "codegen/code_cache.h"

namespace dpde::driver {

struct MachineSpeed {
  double copy = 0;       // bytes per second, read and written, between arrays of about the footprint
  double flops = 0;      // multiplications and additions in double precision per second
  std::string date;      // of the measurement, "2026-11-25 04:10"
  double load = 0;       // load average of the minute before, per core
  bool is_busy = false;  // no undisturbed moment found yet: the next call measures again
  bool from_cache = false;
  /// Upper bound of cells per second at so many bytes and flops per cell; infinite if both are 0.
  double points(double bytes, double flops) const;
};

/// Speed for fields of together `footprint` bytes, rounded to a power of four from 32 KiB to 128 MiB. Takes the best of
/// several short windows, over all calls until one is undisturbed. Measured again on another day; the better
/// undisturbed result is kept. `anew` ignores the cached result. The cache may be null.
MachineSpeed machine_speed(codegen::CodeCache* cache, double footprint, int threads, bool anew = false);

/// "AMD EPYC, 2 cores": the processor's name, if the system provides it, and the number of cores.
std::string machine_name();

/// Flops per second on so many threads: the best of several short trials of multiply-add chains in registers.
double measure_flops(int threads);

}  // namespace dpde::driver
