// SPDX-License-Identifier: Apache-2.0
// sin, cos, exp, log, tanh, pow, ... of cells: bit-identical for a cell in any vector lane, loop remainder, tile or
// thread. Emitted C++ includes this file; the JIT compiler runs the same text with values of its IR in place of
// numbers. So there are no branches, and products are added only by fma(), which leaves compilers nothing to contract.
// Arguments outside of a formula's range set `far`: only for these the caller uses the C library. Errors, measured by
// tests/codegen/elementary_test.cpp, are in compiler/src/codegen/README.md.
//
// A `Lanes` has: Number, Bits (unsigned, of the same width), Truth, Scalar; number(c), integer(c), no() (a Truth);
// fma(a, b, c), size(a), root(a); bits(number), number_of(bits), select(truth, a, b), is_set(bits), is_unset(bits),
// less(a, b), beyond(a, b): not a <= b; wide(): Lanes of doubles, and widen(a) and narrow(b) between the two.
#pragma once

#include <math.h>
#include <stdint.h>
#include <string.h>

namespace dpde {
namespace elementary {

/// c0 + c1*x + c2*x^2 + ...
template <class Lanes, class Number>
Number polynomial(const Lanes& lanes, const Number&, double c) {
  return lanes.number(c);
}
template <class Lanes, class Number, class... Rest>
Number polynomial(const Lanes& lanes, const Number& x, double c, Rest... rest) {
  return lanes.fma(polynomial(lanes, x, rest...), x, lanes.number(c));
}

/// Constants of each precision. Minimax polynomials:
///   sine         (sin(r)/r - 1)/r^2 of r^2, |r| <= pi/4
///   cosine       (cos(r) - 1 + r^2/2)/r^4 of r^2, |r| <= pi/4
///   rest_of_exp  (exp(r) - 1 - r)/r^2, |r| <= log(2)/2
///   atanh        (2 atanh(s)/s - 2)/s^2 of s^2, |s| <= 3 - sqrt(8)
///   sinh         (sinh(a)/a - 1)/a^2 of a^2, a <= 1
///   tanh_above/tanh_below  (tanh(a)/a - 1)/a^2 of a^2, a <= 5/8 (Cephes)
///   atan         (atan(q)/q - 1)/q^2 of q^2, |q| <= tan(pi/8)
///   asin         (asin(s)/s - 1)/s^2 of s^2, s <= 1/2
///   erf          erf(a)/a - 1 of a^2, a <= 1
///   log_erfc     log(1 - erf(a)) of a, 1 <= a <= most_erf; its error counts times 1 - erf(a)
template <class Scalar>
struct Precise;

template <>
struct Precise<double> {
  static constexpr int width = 64, mantissa = 52;
  static constexpr uint64_t one = UINT64_C(0x3ff0000000000000), root_half = UINT64_C(0x3fe6a09e667f3bcd);
  static constexpr double shift = 6755399441055744.0;  // x + shift - shift is the whole number nearest to x
  static constexpr double count = 4503599627370496.0, bias = 1023;
  static constexpr double two_over_pi = 0.6366197723675814, log2_e = 1.4426950408889634;
  static constexpr double pi_half_1 = 1.5707963267948966, pi_half_2 = 6.123233995736766e-17,
                          pi_half_3 = -1.4973849048591698e-33;
  static constexpr double ln2_1 = 0.6931471805599453, ln2_2 = 2.3190468138462996e-17;
  static constexpr double most_turned = 1073741824.0;        // largest argument of sin, cos and tan
  static constexpr double least_exp = -746, most_exp = 710;  // exp is 0 below, infinite above
  static constexpr double most_sinh = 709, most_tanh = 20, most_erf = 6;
  static constexpr double least_normal = 2.2250738585072014e-308, most = 1.7976931348623157e+308;

  template <class Lanes, class Number>
  static Number sine(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, -0.16666666666666632, 0.00833333333332237, -0.00019841269829771137,
                      2.7557313678663433e-06, -2.505075596189405e-08, 1.5896666572021065e-10);
  }
  template <class Lanes, class Number>
  static Number cosine(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.0416666666666666, -0.0013888888888874066, 2.4801587289443638e-05,
                      -2.7557314340700875e-07, 2.087572162903361e-09, -1.1359559595705707e-11);
  }
  template <class Lanes, class Number>
  static Number rest_of_exp(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.5, 0.16666666666666685, 0.04166666666666673, 0.008333333333316617,
                      0.0013888888888858209, 0.00019841269897361943, 2.480158737409264e-05, 2.755723392954036e-06,
                      2.7557233106646933e-07, 2.5112348416370125e-08, 2.0927013291924297e-09);
  }
  template <class Lanes, class Number>
  static Number atanh(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.6666666666666735, 0.3999999999940746, 0.2857142874414594, 0.222221983780896,
                      0.1818357518325842, 0.1531375533958525, 0.14799070125691854);
  }
  template <class Lanes, class Number>
  static Number sinh(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.16666666666666669, 0.008333333333333139, 0.00019841269841437678,
                      2.755731915533766e-06, 2.505212339840952e-08, 1.6057240353181863e-10, 7.759311842391483e-13);
  }
  template <class Lanes, class Number>
  static Number atan(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, -0.3333333333333333, 0.19999999999995513, -0.1428571428466482, 0.11111111015117626,
                      -0.09090904572487347, 0.07692183059894114, -0.06664509603255386, 0.05858132894427922,
                      -0.05085365922344248, 0.03922923713835943, -0.01917392228554793);
  }
  template <class Lanes, class Number>
  static Number asin(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.16666666666666669, 0.07499999999998425, 0.04464285714637338, 0.030381944137085216,
                      0.022372173002005596, 0.017352391265909227, 0.013971235301124539, 0.011478952690257387,
                      0.010324318288744113, 0.00545087818772055, 0.017419357964884856, -0.014881409392818066,
                      0.02877844261259304);
  }
  template <class Lanes, class Number>
  static Number tanh_above(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, -1614.6876844170845, -99.28772310019185, -0.9643991794250523);
  }
  template <class Lanes, class Number>
  static Number tanh_below(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 4844.063053251255, 2235.4883906010045, 112.81167849163293, 1);
  }
  template <class Lanes, class Number>
  static Number erf(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.12837916709551256, -0.3761263890318355, 0.11283791670945252, -0.026866170643276066,
                      0.005223977607422435, -0.0008548325989657169, 0.00012055295319582524, -1.492474465046278e-05,
                      1.644751756907581e-06, -1.6209175410177945e-07, 1.3722975331622362e-08, -7.801189110283002e-10);
  }
  template <class Lanes, class Number>
  static Number log_erfc(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, -5.132353128429367e-07, -1.128373991776822, -0.6366440547765997, -0.10270229076741853,
                      0.018988044025058142, 0.0004135336009249529, -0.001918942294676361, 0.0007730402077688685,
                      -0.00013655225745193793, -1.9524830219078924e-05, 2.253368148755925e-05, -8.579036799493762e-06,
                      2.1148618123443585e-06, -3.6957674109698616e-07, 4.5934715054282496e-08, -3.890150708232215e-09,
                      2.0204202447143395e-10, -4.8653036146992094e-12);
  }
};

template <>
struct Precise<float> {
  static constexpr int width = 32, mantissa = 23;
  static constexpr uint64_t one = 0x3f800000, root_half = 0x3f3504f3;
  static constexpr double shift = 12582912.0, count = 8388608.0, bias = 127;
  static constexpr double two_over_pi = 0.6366197466850281, log2_e = 1.4426950216293335;
  static constexpr double pi_half_1 = 1.5707963705062866, pi_half_2 = -4.371138828673793e-08,
                          pi_half_3 = -1.7151245100058819e-15;
  static constexpr double ln2_1 = 0.6931471824645996, ln2_2 = -1.9046542121259336e-09;
  static constexpr double most_turned = 131072.0, least_exp = -105, most_exp = 89, most_sinh = 88, most_tanh = 10,
                          most_erf = 4;
  static constexpr double least_normal = 1.1754943508222875e-38, most = 3.4028234663852886e+38;

  template <class Lanes, class Number>
  static Number sine(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, -0.16666655242443085, 0.008332176133990288, -0.00019516977772582322);
  }
  template <class Lanes, class Number>
  static Number cosine(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.04166664555668831, -0.0013887364184483886, 2.443809171381872e-05);
  }
  template <class Lanes, class Number>
  static Number rest_of_exp(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.5, 0.1666666716337204, 0.041666269302368164, 0.008333263918757439,
                      0.0013946176040917635, 0.00019918559701181948);
  }
  template <class Lanes, class Number>
  static Number atanh(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.6666666269302368, 0.4000033736228943, 0.28537169098854065, 0.23584988713264465);
  }
  template <class Lanes, class Number>
  static Number sinh(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.1666666716337204, 0.008333350531756878, 0.0001983606634894386, 2.817439735736116e-06);
  }
  template <class Lanes, class Number>
  static Number atan(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, -0.3333333134651184, 0.19999539852142334, -0.14263944327831268, 0.10743605345487595,
                      -0.06451509147882462);
  }
  template <class Lanes, class Number>
  static Number asin(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.1666666567325592, 0.07500094920396805, 0.044599320739507675, 0.031101727858185768,
                      0.017143717035651207, 0.03370072692632675);
  }
  template <class Lanes, class Number>
  static Number tanh_above(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, -0.3333328068256378, 0.13331441581249237, -0.05373971536755562, 0.0206390880048275,
                      -0.0057049887254834175);
  }
  template <class Lanes, class Number>
  static Number tanh_below(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 1);
  }
  template <class Lanes, class Number>
  static Number erf(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, 0.12837916612625122, -0.3761262595653534, 0.11283600330352783, -0.026854444295167923,
                      0.005189535208046436, -0.0008020841632969677, 7.889119297033176e-05);
  }
  template <class Lanes, class Number>
  static Number log_erfc(const Lanes& lanes, const Number& x) {
    return polynomial(lanes, x, -0.00035375470179133117, -1.127039909362793, -0.6382259130477905, -0.10303715616464615,
                      0.021805213764309883, -0.0029395809397101402, 0.00018557129078544676);
  }
};

/// The functions on numbers of a Lanes.
template <class Lanes>
struct Functions {
  using Number = typename Lanes::Number;
  using Bits = typename Lanes::Bits;
  using Truth = typename Lanes::Truth;
  using Of = Precise<typename Lanes::Scalar>;

  Lanes lanes;

  struct Result {
    Number value;
    Truth far;
  };

  Number number(double c) const { return lanes.number(c); }
  Bits integer(uint64_t c) const { return lanes.integer(c); }
  Bits sign_of(const Number& x) const { return lanes.bits(x) & integer(UINT64_C(1) << (Of::width - 1)); }
  Number flipped(const Number& x, const Bits& sign) const { return lanes.number_of(lanes.bits(x) ^ sign); }

  // ---- sin, cos, tan ------------------------------------------------------------------------------------------------

  /// Argument reduction of a >= 0: number of quarter turns, and sin and cos of the remainder r, |r| slightly above pi/4
  /// at most.
  struct Turned {
    Bits quarters;
    Number sine, cosine;
  };
  Turned turned(const Number& a) const {
    const Number shifted = lanes.fma(a, number(Of::two_over_pi), number(Of::shift));
    const Number minus_n = number(Of::shift) - shifted;
    // The first difference is exact; `tail` collects the rounding errors of the product and of the sum after it.
    const Number first = lanes.fma(minus_n, number(Of::pi_half_1), a);
    const Number second = lanes.fma(minus_n, number(Of::pi_half_2), number(0));
    const Number r = first + second;
    const Number lost = lanes.fma(minus_n, number(Of::pi_half_2), -second) + ((first - r) + second);
    const Number tail = lanes.fma(minus_n, number(Of::pi_half_3), lost);
    const Number square = r * r;
    const Number sine = r + lanes.fma(r * square, Of::sine(lanes, square), tail);
    // 1 - r^2/2 and its rounding error
    const Number half = r * number(-0.5);
    const Number parabola = lanes.fma(half, r, number(1));
    const Number below = lanes.fma(half, r, number(1) - parabola);
    const Number rest = lanes.fma(square * square, Of::cosine(lanes, square), lanes.fma(-r, tail, below));
    return {lanes.bits(shifted), sine, parabola + rest};
  }
  Truth is_odd(const Bits& quarters) const { return lanes.is_set(quarters & integer(1)); }

  Result sin(const Number& x) const {
    const Number a = lanes.size(x);
    const Turned t = turned(a);
    const Bits sign = ((t.quarters & integer(2)) << (Of::width - 2)) ^ sign_of(x);
    return {flipped(lanes.select(is_odd(t.quarters), t.cosine, t.sine), sign),
            lanes.beyond(a, number(Of::most_turned))};
  }
  Result cos(const Number& x) const {
    const Number a = lanes.size(x);
    const Turned t = turned(a);
    const Bits sign = ((t.quarters + integer(1)) & integer(2)) << (Of::width - 2);
    return {flipped(lanes.select(is_odd(t.quarters), t.sine, t.cosine), sign),
            lanes.beyond(a, number(Of::most_turned))};
  }
  Result tan(const Number& x) const {
    const Number a = lanes.size(x);
    const Turned t = turned(a);
    const Truth odd = is_odd(t.quarters);
    const Number ratio = lanes.select(odd, t.cosine, t.sine) / lanes.select(odd, t.sine, t.cosine);
    const Bits sign = ((t.quarters & integer(1)) << (Of::width - 1)) ^ sign_of(x);
    return {flipped(ratio, sign), lanes.beyond(a, number(Of::most_turned))};
  }

  // ---- asin, acos, atan ---------------------------------------------------------------------------------------------

  /// atan(a) from atan(q), |q| <= tan(pi/8), plus a constant: q = a; or (a - 1)/(a + 1), plus pi/4; or -1/a, plus pi/2.
  Result atan(const Number& x) const {
    const Number a = lanes.size(x), none = number(0);
    const Truth is_small = lanes.less(a, number(0.41421356237309503)),
                is_large = lanes.less(number(2.414213562373095), a);
    const Number top = lanes.select(is_small, a, lanes.select(is_large, number(-1), a - number(1)));
    const Number bottom = lanes.select(is_small, number(1), lanes.select(is_large, a, a + number(1)));
    const Number q = top / bottom, square = q * q;
    const Number turn =
        lanes.select(is_small, none, lanes.select(is_large, number(Of::pi_half_1), number(0.5 * Of::pi_half_1)));
    const Number rest =
        lanes.select(is_small, none, lanes.select(is_large, number(Of::pi_half_2), number(0.5 * Of::pi_half_2)));
    return {flipped(turn + (q + lanes.fma(q * square, Of::atan(lanes, square), rest)), sign_of(x)), lanes.no()};
  }
  /// asin(s) = s + bent: s = a up to a = 1/2; above, s = sqrt((1 - a)/2) and asin(a) = pi/2 - 2 asin(s).
  struct Arc {
    Truth is_small;
    Number s, bent;
  };
  Arc arc(const Number& a) const {
    const Truth is_small = lanes.less(a, number(0.5));
    const Number beyond = lanes.fma(a, number(-0.5), number(0.5));
    const Number square = lanes.select(is_small, a * a, beyond), s = lanes.select(is_small, a, lanes.root(beyond));
    return {is_small, s, s * square * Of::asin(lanes, square)};
  }
  Result asin(const Number& x) const {
    const Arc v = arc(lanes.size(x));
    const Number large = number(Of::pi_half_1) - ((v.s + v.s) + ((v.bent + v.bent) - number(Of::pi_half_2)));
    return {flipped(lanes.select(v.is_small, v.s + v.bent, large), sign_of(x)), lanes.no()};
  }
  Result acos(const Number& x) const {
    const Arc v = arc(lanes.size(x));
    const Bits sign = sign_of(x);
    const Number small = number(Of::pi_half_1) - (flipped(v.s, sign) + (flipped(v.bent, sign) - number(Of::pi_half_2)));
    const Number twice = v.s + v.s, bent = v.bent + v.bent;
    const Number below = number(2 * Of::pi_half_1) - (twice + (bent - number(2 * Of::pi_half_2)));
    return {lanes.select(v.is_small, small, lanes.select(lanes.less(x, number(0)), below, twice + bent)), lanes.no()};
  }

  // ---- exp, sinh, cosh, tanh ----------------------------------------------------------------------------------------

  /// exp(x + tail) = 2^n*(1 + rest), with n in the low bits of `whole`; x is finite and not far outside the range of
  /// exp.
  struct Split {
    Bits whole;
    Number rest;
  };
  Split split(const Number& x, const Number& tail) const {
    const Number shifted = lanes.fma(x, number(Of::log2_e), number(Of::shift));
    const Number minus_n = number(Of::shift) - shifted;
    const Number r = lanes.fma(minus_n, number(Of::ln2_2), lanes.fma(minus_n, number(Of::ln2_1), x)) + tail;
    return {lanes.bits(shifted), lanes.fma(r * r, Of::rest_of_exp(lanes, r), r)};
  }
  Split split(const Number& x) const {
    const Number shifted = lanes.fma(x, number(Of::log2_e), number(Of::shift));
    const Number minus_n = number(Of::shift) - shifted;
    const Number r = lanes.fma(minus_n, number(Of::ln2_2), lanes.fma(minus_n, number(Of::ln2_1), x));
    return {lanes.bits(shifted), lanes.fma(r * r, Of::rest_of_exp(lanes, r), r)};
  }
  /// 2^n, if that is a normal number
  Number power_of_two(const Bits& n) const { return lanes.number_of((n << Of::mantissa) + integer(Of::one)); }
  /// exp from its split; 2^n is applied in two factors, since alone it may overflow or be 0.
  Number joined(const Split& s) const {
    const Bits half = s.whole >> 1;
    return (s.rest + number(1)) * power_of_two(half) * power_of_two(s.whole - half);
  }
  /// exp(x), if 2^n is a normal number
  Number power(const Number& x) const {
    const Split s = split(x);
    const Number whole = power_of_two(s.whole);
    return lanes.fma(whole, s.rest, whole);
  }
  /// NaN is returned as NaN.
  Number at_most(const Number& x, double most) const {
    return lanes.select(lanes.less(number(most), x), number(most), x);
  }

  Number exp_of(const Number& x) const {
    const Number above = lanes.select(lanes.less(x, number(Of::least_exp)), number(Of::least_exp), x);
    return joined(split(at_most(above, Of::most_exp)));
  }
  Result exp(const Number& x) const { return {exp_of(x), lanes.no()}; }
  /// 1 - 2/(exp(2a) + 1); for small a, where that cancels, a + a^3*p/q. Both need one quotient.
  Result tanh(const Number& x) const {
    const Number a = at_most(lanes.size(x), Of::most_tanh);  // tanh is 1 there
    const Truth is_small = lanes.less(a, number(0.625));
    const Number square = a * a, above = Of::tanh_above(lanes, square) * (square * a);
    const Number below = lanes.select(is_small, Of::tanh_below(lanes, square), power(a + a) + number(1));
    const Number quotient = lanes.select(is_small, above, number(-2)) / below;
    return {flipped(lanes.select(is_small, a, number(1)) + quotient, sign_of(x)), lanes.no()};
  }
  Result sinh(const Number& x) const {
    const Number a = lanes.size(x), square = a * a;
    const Number e = power(at_most(a, Of::most_sinh));
    const Number value = lanes.select(lanes.less(a, number(1)), lanes.fma(a * square, Of::sinh(lanes, square), a),
                                      lanes.fma(e, number(0.5), number(-0.5) / e));
    return {flipped(value, sign_of(x)), lanes.beyond(a, number(Of::most_sinh))};
  }
  Result cosh(const Number& x) const {
    const Number a = lanes.size(x);
    const Number e = power(at_most(a, Of::most_sinh));
    return {lanes.fma(e, number(0.5), number(0.5) / e), lanes.beyond(a, number(Of::most_sinh))};
  }

  // ---- erf ----------------------------------------------------------------------------------------------------------

  /// a + a*p(a^2) up to 1; above it 1 - exp(log(erfc(a))).
  Result erf(const Number& x) const {
    const Number a = at_most(lanes.size(x), Of::most_erf);  // erf is 1 there
    const Number near_0 = lanes.fma(a, Of::erf(lanes, a * a), a), beyond = number(1) - power(Of::log_erfc(lanes, a));
    return {flipped(lanes.select(lanes.less(a, number(1)), near_0, beyond), sign_of(x)), lanes.no()};
  }

  // ---- log ----------------------------------------------------------------------------------------------------------

  /// x = 2^n*(1 + f), 1 + f between sqrt(1/2) and sqrt(2); for positive normal x.
  struct Scaled {
    Number n, f;
  };
  Scaled scaled(const Number& x) const {
    const Bits moved = lanes.bits(x) + integer(Of::one - Of::root_half);
    const Number biased = lanes.number_of((moved >> Of::mantissa) | lanes.bits(number(Of::count)));
    const Bits digits = moved & integer((UINT64_C(1) << Of::mantissa) - 1);
    return {biased - number(Of::count + Of::bias), lanes.number_of(digits + integer(Of::root_half)) - number(1)};
  }
  Truth is_no_positive_normal(const Number& x) const {
    return lanes.beyond(number(Of::least_normal), x) | lanes.beyond(x, number(Of::most));
  }
  /// With s = f/(2 + f): log(1 + f) = 2 atanh(s) = f - f^2/2 + s*(f^2/2 + s^2*(...)).
  Number log_of(const Number& x) const {
    const Scaled v = scaled(x);
    const Number s = v.f / (v.f + number(2)), square = s * s, half = v.f * number(0.5);
    const Number bent = lanes.fma(square, Of::atanh(lanes, square), half * v.f);
    const Number inner = lanes.fma(s, bent, v.n * number(Of::ln2_2));
    return lanes.fma(v.n, number(Of::ln2_1), v.f - lanes.fma(half, v.f, -inner));
  }
  Result log(const Number& x) const { return {log_of(x), is_no_positive_normal(x)}; }

  // ---- pow ----------------------------------------------------------------------------------------------------------

  /// A number as an unevaluated sum of two.
  struct Pair {
    Number high, low;
  };
  /// Exact a + b as a pair, if |a| >= |b| or a = 0
  Pair sum(const Number& a, const Number& b) const {
    const Number high = a + b;
    return {high, b - (high - a)};
  }
  Pair product(const Pair& a, const Pair& b) const {
    const Number high = a.high * b.high;
    const Number low = lanes.fma(a.high, b.high, -high);
    return {high, lanes.fma(a.low, b.high, lanes.fma(a.high, b.low, low))};
  }
  /// log(x), in double precision, with relative error of about 2^-64.
  Pair log_in_two(const Number& x) const {
    const Scaled v = scaled(x);
    const Pair below = sum(number(2), v.f);
    const Number inverse = number(1) / below.high, high = v.f * inverse;
    const Number left = lanes.fma(-high, below.low, lanes.fma(-high, below.high, v.f));
    const Pair s{high, left * inverse}, square = product(s, s), cube = product(s, square);
    const Number bent = polynomial(lanes, square.high, 0.4000000000000229, 0.2857142857008378, 0.2222222252287272,
                                   0.18181784098499879, 0.15386770153360527, 0.13256509479608883, 0.13199273744393145);
    const Number third = lanes.fma(square.high, bent, number(3.700743415417188e-17));
    const Pair curve = product(cube, Pair{number(0.6666666666666666), third});
    const Pair whole = sum(v.n * number(0.6931471805598903), s.high + s.high);  // the first product is exact
    const Pair both = sum(whole.high, curve.high);
    const Number lows = lanes.fma(v.n, number(5.497923018708371e-14), lanes.fma(s.low, number(2), curve.low));
    return sum(both.high, lows + (whole.low + both.low));
  }
  Result pow_of(const Precise<double>&, const Number& x, const Number& y) const {
    const Pair log = log_in_two(x);
    const Number exponent = y * log.high;
    const Number tail = lanes.fma(y, log.low, lanes.fma(y, log.high, -exponent));
    return {joined(split(exponent, tail)), lanes.beyond(lanes.size(exponent), number(700))};
  }
  Result pow_of(const Precise<float>&, const Number& x, const Number& y) const {
    const auto wide = lanes.wide();
    const Functions<typename Lanes::Wide> doubles{wide};
    const auto power = doubles.exp_of(lanes.widen(y) * doubles.log_of(lanes.widen(x)));
    return {lanes.narrow(power), lanes.no()};
  }
  Result pow(const Number& x, const Number& y) const {
    const Truth is_zero = lanes.beyond(y, number(0)) & lanes.is_unset(lanes.bits(x));  // 0^y, y > 0
    const Number base = lanes.select(is_zero, number(1), x);
    const Result power = pow_of(Of(), base, y);
    const Truth far = power.far | is_no_positive_normal(base) | lanes.beyond(lanes.size(y), number(Of::most));
    return {lanes.select(is_zero, number(0), power.value), far};
  }
};

}  // namespace elementary
}  // namespace dpde
