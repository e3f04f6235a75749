// SPDX-License-Identifier: Apache-2.0
// Finds states that a step may overwrite in place, without a second buffer: u_t_next = u_t + dt*c2*lap(u) reads u_t
// only at its own cell.
#pragma once

#include "loop/loop.h"

namespace dpde::loop {

/// Marks the swaps (Swap::is_over) whose next value may share the memory of the state, and the streams (Stream::over)
/// of the rows that write such values. The runtime chooses whether they do; results are bitwise equal.
Module find_overwrites(Module module);

}  // namespace dpde::loop
