// SPDX-License-Identifier: Apache-2.0
// Elementary functions of vectors. Included by files that are each compiled for one instruction set. Everything has
// internal linkage, so that the linker never uses one file's code for another's. For that reason nothing of the
// standard library is used that could be compiled to functions.
#pragma once

#include <stdint.h>

namespace dpde::nn {
namespace {

template <class Real>
struct Numbers;
template <>
struct Numbers<double> {
  using Bits = int64_t;
  static constexpr int mantissa = 52, exponential_terms = 13, logarithm_terms = 18, erfc_terms = 25;
  static constexpr double shift = 0x1.8p52, ln2_high = 0x1.62e42fee00000p-1, ln2_low = 0x1.a39ef35793c76p-33;
  static constexpr double least = -708, most = 709, far = 40;
  static constexpr int64_t one = int64_t{1023} << 52;
};
template <>
struct Numbers<float> {
  using Bits = int32_t;
  static constexpr int mantissa = 23, exponential_terms = 7, logarithm_terms = 8, erfc_terms = 10;
  static constexpr float shift = 0x1.8p23f, ln2_high = 0x1.62e000p-1f, ln2_low = 0x1.0bfbe8p-15f;
  static constexpr float least = -87, most = 88, far = 20;
  static constexpr int32_t one = 127 << 23;
};

template <class Real, int Bytes>
struct Vectors {
  using Bits = typename Numbers<Real>::Bits;
  typedef Real V __attribute__((vector_size(Bytes)));
  typedef Real Anywhere __attribute__((vector_size(Bytes), aligned(sizeof(Real)), may_alias));
  typedef Bits B __attribute__((vector_size(Bytes)));
  static constexpr int lanes = Bytes / sizeof(Real);
};

/// 1/k!
struct InverseFactorials {
  double of[16]{};
  constexpr InverseFactorials() {
    of[0] = 1;
    for (int k = 1; k < 16; ++k) of[k] = of[k - 1] / k;
  }
};
constexpr InverseFactorials inverse_factorials;

/// Coefficients of exp(z^2)*erfc(z)/t, z >= 0, in Chebyshev polynomials of 2t-1, t = a/(a+z).
constexpr double erfc_shape = 3.75;
constexpr double erfc_coefficients[] = {
    0.4214058601090404,     0.37747444362832,       0.14160448337558904,     0.04472136419492391,
    0.0117959706715608,     0.0025349704447309527,  0.0004185659812464711,   4.4764300324499895e-05,
    5.257805411800891e-07,  -8.231924321753128e-07, -1.316512185167472e-07,  2.5425950577591977e-09,
    3.6155375955980613e-09, 2.8881129031517165e-10, -7.744049094712806e-11,  -1.4154099941115766e-11,
    1.541532080291853e-12,  5.316760838441818e-13,  -3.1266208417670866e-14, -1.931405980218627e-14,
    7.681944620990154e-16,  7.212640982187403e-16,  -2.9234747015733566e-17, -2.800417314058823e-17,
    1.6437419195738499e-18};

template <class Real, int Bytes>
struct Maths {
  using T = Vectors<Real, Bytes>;
  using V = typename T::V;
  using B = typename T::B;
  using N = Numbers<Real>;

  /// Not V{} + value: 0 + (-0) differs from -0, so the compiler would keep the sum in the innermost loop of
  /// convolutions.
  static V all(Real value) { return value - V{}; }
  static V larger(V a, V b) { return a < b ? b : a; }
  static V size_of(V a) { return a < 0 ? -a : a; }

  /// exp(x) = power + power*rest, power a power of two, rest = exp(r) - 1 with the smallest |r|; NaN stays NaN.
  struct Exponential {
    V power, rest;
  };
  static Exponential split(V x) {
    x = x < N::least ? all(N::least) : x;
    x = x > N::most ? all(N::most) : x;
    const V shifted = x * static_cast<Real>(0x1.71547652b82fep0) + N::shift;
    const V whole = shifted - N::shift;
    const V r = (x - whole * N::ln2_high) - whole * N::ln2_low;
    V sum = all(static_cast<Real>(inverse_factorials.of[N::exponential_terms]));
#pragma GCC unroll 16
    for (int k = N::exponential_terms - 1; k > 0; --k) sum = sum * r + static_cast<Real>(inverse_factorials.of[k]);
    const B power = ((B)shifted << N::mantissa) + N::one;
    return {(V)power, sum * r};
  }
  static V exp(V x) {
    const Exponential e = split(x);
    return e.power + e.power * e.rest;
  }
  /// exp(x) - 1 with full relative accuracy near 0.
  static V expm1(V x) {
    const Exponential e = split(x);
    return e.power * e.rest + (e.power - static_cast<Real>(1));
  }
  /// log(1 + t) for t in 0 .. 1: 2*artanh(t/(2 + t)).
  static V log1p(V t) {
    const V s = t / (static_cast<Real>(2) + t), square = s * s;
    V sum = all(0);
#pragma GCC unroll 20
    for (int k = N::logarithm_terms; k >= 0; --k)
      sum = sum * square + static_cast<Real>(2) / static_cast<Real>(2 * k + 1);
    return sum * s;
  }
  static V tanh(V x) {
    // Beyond, tanh rounds to 1.
    x = x > N::far / 2 ? all(N::far / 2) : x;
    x = x < -N::far / 2 ? all(-N::far / 2) : x;
    const V e = expm1(x + x);
    return e / (e + static_cast<Real>(2));
  }
  static V sigmoid(V x) { return static_cast<Real>(1) / (static_cast<Real>(1) + exp(-x)); }
  static V softplus(V x) { return larger(all(0), x) + log1p(exp(-size_of(x))); }
  /// exp(z^2)*erfc(z) for z >= 0.
  static V scaled_erfc(V z) {
    const V t = static_cast<Real>(erfc_shape) / (static_cast<Real>(erfc_shape) + z), u = t + t - static_cast<Real>(1);
    V a = all(0), b = all(0);
#pragma GCC unroll 25
    for (int k = N::erfc_terms - 1; k > 0; --k) {
      const V next = (u + u) * a - b + static_cast<Real>(erfc_coefficients[k]);
      b = a;
      a = next;
    }
    return t * (u * a - b + static_cast<Real>(erfc_coefficients[0]));
  }
  /// Normal distribution: the cumulative probability below x, and the density.
  struct Normal {
    V below, density;
  };
  static Normal normal(V x) {
    const V e = exp(x * x * static_cast<Real>(-0.5));
    const V tail = e * scaled_erfc(size_of(x) * static_cast<Real>(0.70710678118654752440)) * static_cast<Real>(0.5);
    return {x > 0 ? static_cast<Real>(1) - tail : tail, e * static_cast<Real>(0.39894228040143267794)};
  }
};

}  // namespace
}  // namespace dpde::nn
