// SPDX-License-Identifier: Apache-2.0
// What this machine can do at best, measured once and kept in the cache: a roofline must not depend on who else works
// while a command asks (S. Williams, A. Waterman and D. Patterson, Comm. ACM 52 (2009)).
#pragma once

#include <string>

#include "codegen/code_cache.h"

namespace dpde::driver {

struct MachineSpeed {
  double copy = 0;       // bytes a second, read and written, between arrays of about the footprint
  double flops = 0;      // multiplications and additions in double precision a second
  std::string date;      // of the measurement, "2026-11-25 04:10"
  double load = 0;       // a core: how many processes wanted each of them in the minute before
  bool is_busy = false;  // no undisturbed moment was found yet: the next call measures again
  bool from_cache = false;
  /// Cells a second, at most, of what moves so many bytes and takes so many operations each; infinite of nothing.
  double points(double bytes, double flops) const;
};

/// For fields of together `footprint` bytes, rounded to a power of four from 32 KiB to 128 MiB. The best of several
/// short windows, and of all measurements until one was undisturbed; on another day it is measured once more, and what
/// is better in an undisturbed moment stays. `anew` forgets all. The cache may be null.
MachineSpeed machine_speed(codegen::CodeCache* cache, double footprint, int threads, bool anew = false);

/// "AMD EPYC, 2 cores": the processor's name, where the system tells it, and how many cores there are.
std::string machine_name();

/// The best of several short trials on so many threads: chains of products and sums that stay in registers.
double measure_flops(int threads);

}  // namespace dpde::driver
