// SPDX-License-Identifier: Apache-2.0
// Nested blocks of statements, for the walks of support/walk.h.
#pragma once

#include "stencil/stencil.h"
#include "support/match.h"
#include "support/walk.h"

namespace dpde::stencil {

/// Calls `f` on each list of statements inside the statement.
template <OneOf<Statement> S, class F>
void for_each_block(S& statement, Blocks blocks, const F& f) {
  match(
      statement, ignored<Fill, Fold, Reduce, NetworkCall, Transform, Run>,
      [&](OneOf<Solve> auto& solve) {
        if (blocks == Blocks::all) f(solve.body), f(solve.step);
      },
      [&](OneOf<Repeat> auto& repeat) { f(repeat.body); });
}

}  // namespace dpde::stencil
