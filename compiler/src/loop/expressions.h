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

bool is_literal(const Expr& e, double value);
/// Literal, Uniform, Param, Load or Local: repeating it costs nothing.
bool is_leaf(const Expr& e);

void for_each_child(const Expr& e, const std::function<void(const Expr&)>& f);
/// `e` with `f` applied to each direct child.
Expr map_children(const Expr& e, const std::function<Expr(const Expr&)>& f);
/// Calls `f` on `e` and all its descendants, parents first.
void visit(const Expr& e, const std::function<void(const Expr&)>& f);
/// Calls `f` on every expression of the row: lets, stores, sums, displacements and values of scatters.
void for_each_expression(const Row& row, const std::function<void(const Expr&)>& f);
/// Indices of the uniforms the row reads.
std::set<int> used_uniforms(const Row& row);
/// For each uniform, whether it depends on a counter.
std::vector<bool> counted_uniforms(const Module& module);
/// The row with `f` applied to every expression, in the order of for_each_expression.
Row map_expressions(Row row, const std::function<Expr(const Expr&)>& f);

}  // namespace dpde::loop
