// SPDX-License-Identifier: Apache-2.0
// What a program costs, counted before it runs, and what the memory of this machine gives.
#pragma once

#include <cstdint>
#include <string>

#include "dpde/kernel_abi.h"
#include "driver/compile/pipeline.h"
#include "loop/loop.h"

namespace dpde::driver {

/// Per cell and run of a program. Bytes: those of a value for each field a sweep reads and for each it writes (offsets
/// of one field count once, write-allocate not at all). Flops: + - * / and comparisons count 1, functions 1 each,
/// powers 1; of networks the products of their convolutions and the sums, and the fields that go in and out.
struct Cost {
  double bytes = 0, flops = 0;
  Cost& operator+=(const Cost& other) {
    bytes += other.bytes;
    flops += other.flops;
    return *this;
  }
};
Cost cost_of(const loop::Module& module, const std::string& program);

/// How fields of the scene lie in memory.
dpde_layout layout_of(const Compiled& compiled);

/// Bytes that `run` takes at its peak (driver/memory/memory_plan.h), and what a gradient adds beside the states it
/// stores (driver/memory/storage.h): sums of control fields. `part` comes for each part of the step that a Courant
/// number splits into most; 0 where that stores nothing.
struct Memory {
  double run = 0, gradient = 0, part = 0;
};
Memory memory_of(const Compiled& compiled);

/// Bytes of memory that can be had now (/proc/meminfo and the limits of a container).
std::int64_t available_memory();

/// How fast memory is copied: bytes per second (8 read and 8 written an element), and whether others used the processor
/// meanwhile.
struct CopyRate {
  double best = 0;
  double load = 0;  // a core, of the last minute; 0 where it is not known
  bool is_busy = false;
};
/// Between two arrays of together `footprint` bytes, on one thread and on `threads`: the best of several short trials.
/// What else runs on the machine makes a trial slower, never faster.
CopyRate measure_copy(double footprint, int threads);

}  // namespace dpde::driver
