// SPDX-License-Identifier: Apache-2.0
// Which states steps may be written over, so that they need no second memory: u_t_next = u_t + dt*c2*lap(u) reads u_t
// at its own cell alone.
#pragma once

#include "loop/loop.h"

namespace dpde::loop {

/// Marks the swaps (Swap::is_over) whose next value may have the memory of the state, and the streams (Stream::over) of
/// the rows that write such values. Whether it has is the runtime's choice: values are the same to the last bit.
Module find_overwrites(Module module);

}  // namespace dpde::loop
