// SPDX-License-Identifier: Apache-2.0
// Constructors and traversals of loop expressions. The constructors only move signs outwards (a + -b is a - b) and drop
// neutral numbers; all other simplifications are done at the stencil level.
#pragma once

#include <functional>
#include <set>
#include <vector>

#include "loop/loop.h"

namespace dpde::loop {

Expr make(Kind kind);
Expr negate(const Expr& a);
Expr binary(BinaryOp op, const Expr& a, const Expr& b);
/// The product of all factors, from left to right; 1 when there are none.
Expr product(const std::vector<Expr>& factors);

/// Literal, Uniform, Param, Load or Local: repeating it costs nothing.
bool is_leaf(const Expr& e);

/// Indices of the uniforms the row reads.
std::set<int> used_uniforms(const Row& row);
/// For each uniform, whether it depends on a counter.
std::vector<bool> counted_uniforms(const Module& module);

}  // namespace dpde::loop
