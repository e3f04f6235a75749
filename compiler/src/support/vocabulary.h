// SPDX-License-Identifier: Apache-2.0
// The words all levels share: operators, functions, kinds of axes and of boundaries, precisions.
#pragma once

#include <optional>
#include <string_view>

namespace dpde {

enum class BinaryOp { add, subtract, multiply, divide, power, less, less_equal, greater, greater_equal, equal, not_equal, logical_and, logical_or };
enum class Fn { sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, exp, log, sqrt, abs, sign, floor, fraction, min, max };

enum class Topology { periodic, bounded };
/// on_wall: the value at a side where the axis's last entry lies on the wall itself, of a field that is staggered along it.
enum class SideKind { value, zero_gradient, gradient, mixed, on_wall };
/// How the values of a field along some axes become one.
enum class Reduction { mean, sum, max, min };
/// What the values of fields are, and what is computed with them.
enum class Precision { f64, f32 };

/// As written: "+", "<=", "and", ...
std::string_view spelling(BinaryOp op);
/// Higher binds tighter: or 1, and 2, comparisons 3, + - 4, * / 5, (unary minus 6,) ^ 7. All but ^ associate to the left.
int precedence(BinaryOp op);
constexpr int unary_precedence = 6;

std::string_view name_of(Fn fn);
std::optional<Fn> find_fn(std::string_view name);
int arity(Fn fn);

std::string_view name_of(Reduction reduction);
std::optional<Reduction> find_reduction(std::string_view name);

/// "f64", "f32"
std::string_view name_of(Precision real);
int bytes_of(Precision real);
/// The value a field of this precision holds when it is given `value`.
double rounded(double value, Precision real);

}  // namespace dpde
