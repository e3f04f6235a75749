// SPDX-License-Identifier: Apache-2.0
// The table of derivatives: one rule for each operator and function, for the formulas of every level. A level has,
// in addition to its expressions E, to which numbers convert: negate(a), binary(op, a, b), call(fn, arguments),
// select(condition, yes, no), literal_value(e), the value of a number, and slope_of_tanh(a).
//
// A rule gives x*df/da: for tangents x is the rate of a, for adjoints the seed of f. Derivatives are derived again, so
// of two equal forms the table has the one that stays finite then, and of those the more accurate one:
//  - tanh: each level has its form. Kernels take 1 - tanh^2, which shares tanh. Its error is one rounding of 1, also
//    where the derivative is smaller than that. 1/cosh^2 has all digits there, but its own derivative is 0*inf where
//    cosh overflows: beyond |a| = 710, in f32 beyond 89. Formulas of models take it: stretched axes divide by slopes,
//    and no axis of a grid is stretched by such a factor.
//  - tan: 1 + tan^2, which shares tan. asin, acos: (1 - a)*(1 + a) under the root, exact near 1 where 1 - a^2 is not.
//  - a/b: -(x/b)*(a/b). b^2 overflows where a/b does not.
//  - a^b by b: a^b*log(a), and its limit 0 at a = 0.
//
// Kinks have an element of Clarke's generalised gradient: at a tie max(a, b) has the derivative of a and min(a, b) that
// of b, so that max(a, b) + min(a, b) has that of a + b; abs has 0 at 0. What jumps has the derivative that it has
// beside the jump: 0, and 1 of fraction.
#pragma once

#include <optional>
#include <vector>

#include "support/assert.h"
#include "support/vocabulary.h"

namespace dpde {

template <class E>
class Derivatives {
 public:
  /// x times the derivative of `a op b` by a (index 0) or b (index 1).
  static E times_partial(BinaryOp op, const E& left, const E& right, int index, const E& factor) {
    const Term a{left}, b{right}, x{factor};
    switch (op) {
      case BinaryOp::add: return factor;
      case BinaryOp::subtract: return index == 0 ? factor : negate(factor);
      case BinaryOp::multiply: return (index == 0 ? x * b : x * a).e;
      case BinaryOp::divide: return (index == 0 ? x / b : -(x / b * (a / b))).e;
      case BinaryOp::power: return (index == 0 ? by_base(a, b, x) : by_exponent(a, b, x)).e;
      case BinaryOp::less:
      case BinaryOp::less_equal:
      case BinaryOp::greater:
      case BinaryOp::greater_equal:
      case BinaryOp::equal:
      case BinaryOp::not_equal:
      case BinaryOp::logical_and:
      case BinaryOp::logical_or: return 0.0;
    }
    unreachable("operator");
  }

  /// x times the derivative of the function by the argument of that index.
  static E times_partial(Fn fn, const std::vector<E>& arguments, int index, const E& factor) {
    const Term a{arguments[0]}, x{factor}, one{1.0}, two{2.0};
    switch (fn) {
      case Fn::sin: return (x * of(Fn::cos, a)).e;
      case Fn::cos: return (-(x * of(Fn::sin, a))).e;
      case Fn::tan: return (x * (one + square(of(Fn::tan, a)))).e;
      case Fn::asin: return (x / of(Fn::sqrt, (one - a) * (one + a))).e;
      case Fn::acos: return (-(x / of(Fn::sqrt, (one - a) * (one + a)))).e;
      case Fn::atan: return (x / (one + square(a))).e;
      case Fn::sinh: return (x * of(Fn::cosh, a)).e;
      case Fn::cosh: return (x * of(Fn::sinh, a)).e;
      case Fn::tanh: return (x * Term{slope_of_tanh(a.e)}).e;
      case Fn::exp: return (x * of(Fn::exp, a)).e;
      case Fn::log: return (x / a).e;
      case Fn::erf: return (x * (Term{1.1283791670955126} * of(Fn::exp, -square(a)))).e;  // 2/sqrt(pi)
      case Fn::sqrt: return (x / (two * of(Fn::sqrt, a))).e;
      case Fn::abs: return (x * of(Fn::sign, a)).e;
      case Fn::sign:
      case Fn::floor: return 0.0;
      case Fn::fraction: return factor;
      case Fn::min:
      case Fn::max: {
        const E first = is_first(fn, arguments[0], arguments[1]);
        return index == 0 ? select(first, factor, 0.0) : select(first, 0.0, factor);
      }
    }
    unreachable("function");
  }

  /// Whether min or max has the derivative of its first argument.
  static E is_first(Fn fn, const E& a, const E& b) {
    return binary(fn == Fn::min ? BinaryOp::less : BinaryOp::greater_equal, a, b);
  }

 private:
  /// With the signs of arithmetic, so that rules read as formulas.
  struct Term {
    E e;
    friend Term operator-(const Term& a) { return {negate(a.e)}; }
    friend Term operator+(const Term& a, const Term& b) { return {binary(BinaryOp::add, a.e, b.e)}; }
    friend Term operator-(const Term& a, const Term& b) { return {binary(BinaryOp::subtract, a.e, b.e)}; }
    friend Term operator*(const Term& a, const Term& b) { return {binary(BinaryOp::multiply, a.e, b.e)}; }
    friend Term operator/(const Term& a, const Term& b) { return {binary(BinaryOp::divide, a.e, b.e)}; }
  };
  static Term power(const Term& a, const Term& b) { return {binary(BinaryOp::power, a.e, b.e)}; }
  static Term square(const Term& a) { return power(a, {2.0}); }
  static Term of(Fn fn, const Term& a) { return {call(fn, std::vector<E>{a.e})}; }

  /// b a^(b-1). Of a negative number b the power is a divisor, and a^(b-1) overflows where a^b does not.
  static Term by_base(const Term& a, const Term& b, const Term& x) {
    const std::optional<double> exponent = literal_value(b.e);
    if (exponent == 2) return x * (Term{2.0} * a);
    if (exponent && *exponent < 0) return x / a * (b * power(a, b));
    return x * (b * power(a, b - Term{1.0}));
  }
  static Term by_exponent(const Term& a, const Term& b, const Term& x) {
    const E is_zero = binary(BinaryOp::equal, a.e, 0.0);
    return {select(is_zero, 0.0, (x * (power(a, b) * of(Fn::log, a))).e)};
  }
};

}  // namespace dpde
