// SPDX-License-Identifier: Apache-2.0
// The words all levels share: operators, functions, kinds of axes and of boundaries.
#pragma once

#include <optional>
#include <string_view>

namespace dpde {

enum class BinaryOp { add, subtract, multiply, divide, power, less, less_equal, greater, greater_equal, equal, not_equal, logical_and, logical_or };
enum class Fn { sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, exp, log, sqrt, abs, sign, floor, fraction, min, max };

enum class Topology { periodic, bounded };
enum class SideKind { value, zero_gradient, gradient, mixed };

/// As written: "+", "<=", "and", ...
std::string_view spelling(BinaryOp op);
/// Higher binds tighter: or 1, and 2, comparisons 3, + - 4, * / 5, (unary minus 6,) ^ 7. All but ^ associate to the left.
int precedence(BinaryOp op);
constexpr int unary_precedence = 6;

std::string_view name_of(Fn fn);
std::optional<Fn> find_fn(std::string_view name);
int arity(Fn fn);

}  // namespace dpde
