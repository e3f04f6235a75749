// SPDX-License-Identifier: Apache-2.0
// Operators and functions of numbers, shared by constants of scenes and the reference interpreter.
#pragma once

#include <cmath>
#include <limits>

#include "support/assert.h"
#include "support/vocabulary.h"

namespace dpde {

/// Conditions yield 1 or 0.
inline double evaluate_binary(BinaryOp op, double a, double b) {
  switch (op) {
    case BinaryOp::add: return a + b;
    case BinaryOp::subtract: return a - b;
    case BinaryOp::multiply: return a * b;
    case BinaryOp::divide: return a / b;
    case BinaryOp::power: return std::pow(a, b);
    case BinaryOp::less: return a < b;
    case BinaryOp::less_equal: return a <= b;
    case BinaryOp::greater: return a > b;
    case BinaryOp::greater_equal: return a >= b;
    case BinaryOp::equal: return a == b;
    case BinaryOp::not_equal: return a != b;
    case BinaryOp::logical_and: return a != 0 && b != 0;
    case BinaryOp::logical_or: return a != 0 || b != 0;
  }
  unreachable("operator");
}
/// `b` is ignored by functions of one argument.
double evaluate_call(Fn fn, double a, double b);
/// The same with arguments from `value`, which is called once for each: two calls on each level would give 2^20 for
/// calls nested 20 deep.
template <class Arguments, class ValueOf>
double evaluate_call_of(Fn fn, const Arguments& arguments, const ValueOf& value) {
  const double first = value(arguments.front());
  return evaluate_call(fn, first, arguments.size() > 1 ? value(arguments.back()) : first);
}

/// The value for messages: NaN without sign.
inline double shown(double value) { return std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value; }

}  // namespace dpde
