// SPDX-License-Identifier: Apache-2.0
// Nested blocks of operations, for the walks of support/walk.h.
#pragma once

#include "loop/loop.h"
#include "support/match.h"
#include "support/walk.h"

namespace dpde::loop {

/// Calls `f` on each list of operations inside the operation.
template <OneOf<Operation> O, class F>
void for_each_block(O& operation, Blocks blocks, const F& f) {
  match(
      operation, ignored<Fill, Fold, Reduce, NetworkCall, Transform, Sweep>,
      [&](OneOf<Solve> auto& solve) {
        if (blocks == Blocks::all) f(solve.body), f(solve.step);
      },
      [&](OneOf<Repeat> auto& repeat) { f(repeat.body); });
}

}  // namespace dpde::loop
