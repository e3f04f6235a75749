// SPDX-License-Identifier: Apache-2.0
// Cost of a program, counted before it runs, and the memory of this machine.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "dpde/kernel_abi.h"
#include "driver/compile/pipeline.h"
#include "loop/loop.h"

namespace dpde::driver {

/// Per cell and run of a program. Bytes: one value for each field that a sweep reads and each that it writes (offsets
/// of one field count once; write-allocate does not count). Flops: + - * / and comparisons count 1, functions and
/// powers 1 each. Networks: products and sums of their convolutions, and their input and output fields.
struct Cost {
  double bytes = 0, flops = 0;
  Cost& operator+=(const Cost& other) {
    bytes += other.bytes;
    flops += other.flops;
    return *this;
  }
};
Cost cost_of(const loop::Module& module, const std::string& program);

/// The widest halo that a program of the module needs, one number an axis.
std::array<std::int64_t, 3> halo_of(const Compiled& compiled);

/// Memory layout of the scene's fields.
dpde_layout layout_of(const Compiled& compiled);

/// Peak bytes of `run` (driver/memory/memory_plan.h), and bytes that a gradient needs in addition to stored states
/// (driver/memory/storage.h): sums of control fields. `part`: more bytes for each
/// substep of the step with most substeps, if a Courant number splits steps and they are stored; else 0.
struct Memory {
  double run = 0, gradient = 0, part = 0;
};
Memory memory_of(const Compiled& compiled);

/// Bytes of memory available now (/proc/meminfo and container limits).
std::int64_t available_memory();

/// Speed of memory copies in bytes per second (8 read and 8 written for each element), and whether other processes used
/// the processor meanwhile.
struct CopyRate {
  double best = 0;
  double load = 0;  // load average of the last minute per core; 0 if unknown
  bool is_busy = false;
};
/// Copies between two arrays of together `footprint` bytes, on one thread and on `threads`. Takes the best of several
/// short trials, since other processes only make a trial slower.
CopyRate measure_copy(double footprint, int threads);

}  // namespace dpde::driver
