// SPDX-License-Identifier: Apache-2.0
// The functions of elementary.h for C++: for one number, and for the vectors that g++ passes to functions in vectorised
// loops.
#pragma once

#include "dpde/elementary.h"

namespace dpde {
namespace elementary {
namespace {  // each file's own: other files may be compiled for other processors

/// Lanes of one number. Truth values are masks, all ones or all zeros: with bools and `truth ? a : b` compilers would
/// generate branches and not vectorise.
template <class T, class B>
struct Plain {
  using Scalar = T;
  using Number = T;
  using Bits = B;
  using Truth = B;
  using Wide = Plain<double, uint64_t>;

  static T number(double c) { return static_cast<T>(c); }
  static B integer(uint64_t c) { return static_cast<B>(c); }
  static B no() { return 0; }
  static double fma(double a, double b, double c) { return __builtin_fma(a, b, c); }
  static float fma(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
  static double size(double a) { return __builtin_fabs(a); }
  static float size(float a) { return __builtin_fabsf(a); }
  static double root(double a) { return __builtin_sqrt(a); }
  static float root(float a) { return __builtin_sqrtf(a); }
  static B bits(T a) {
    B b;
    memcpy(&b, &a, sizeof b);
    return b;
  }
  static T number_of(B b) {
    T a;
    memcpy(&a, &b, sizeof a);
    return a;
  }
  static B mask(bool truth) { return B(0) - B(truth); }
  static T select(B truth, T a, T b) { return number_of(bits(b) ^ ((bits(a) ^ bits(b)) & truth)); }
  static B is_set(B b) { return mask(b != 0); }
  static B is_unset(B b) { return mask(b == 0); }
  static B less(T a, T b) { return mask(a < b); }
  static B beyond(T a, T b) { return mask(!(a <= b)); }
  static Wide wide() { return {}; }
  static double widen(T a) { return static_cast<double>(a); }
  static T narrow(double a) { return static_cast<T>(a); }
};
using Double = Functions<Plain<double, uint64_t>>;
using Float = Functions<Plain<float, uint32_t>>;

constexpr Double functions_of(double) { return {}; }
constexpr Float functions_of(float) { return {}; }

// Each function: `near` is the vectorisable formula, `library` that of the C library for other arguments.
struct Sin {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.sin(x);
  }
  static double library(double x) { return ::sin(x); }
  static float library(float x) { return ::sinf(x); }
};
struct Cos {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.cos(x);
  }
  static double library(double x) { return ::cos(x); }
  static float library(float x) { return ::cosf(x); }
};
struct Tan {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.tan(x);
  }
  static double library(double x) { return ::tan(x); }
  static float library(float x) { return ::tanf(x); }
};
struct Exp {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.exp(x);
  }
  static double library(double x) { return ::exp(x); }
  static float library(float x) { return ::expf(x); }
};
struct Log {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.log(x);
  }
  static double library(double x) { return ::log(x); }
  static float library(float x) { return ::logf(x); }
};
struct Sinh {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.sinh(x);
  }
  static double library(double x) { return ::sinh(x); }
  static float library(float x) { return ::sinhf(x); }
};
struct Cosh {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.cosh(x);
  }
  static double library(double x) { return ::cosh(x); }
  static float library(float x) { return ::coshf(x); }
};
struct Tanh {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.tanh(x);
  }
  static double library(double x) { return ::tanh(x); }
  static float library(float x) { return ::tanhf(x); }
};
struct Pow {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x, typename F::Number y) {
    return f.pow(x, y);
  }
  static double library(double x, double y) { return ::pow(x, y); }
  static float library(float x, float y) { return ::powf(x, y); }
};
struct Asin {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.asin(x);
  }
  static double library(double x) { return ::asin(x); }
  static float library(float x) { return ::asinf(x); }
};
struct Acos {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.acos(x);
  }
  static double library(double x) { return ::acos(x); }
  static float library(float x) { return ::acosf(x); }
};
struct Atan {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.atan(x);
  }
  static double library(double x) { return ::atan(x); }
  static float library(float x) { return ::atanf(x); }
};

struct Erf {
  template <class F>
  static typename F::Result near(const F& f, typename F::Number x) {
    return f.erf(x);
  }
  static double library(double x) { return ::erf(x); }
  static float library(float x) { return ::erff(x); }
};

/// The value for one cell.
template <class Function, class T, class... Rest>
T one(T x, Rest... rest) {
  const auto result = Function::near(functions_of(x), x, rest...);
  return result.far != 0 ? Function::library(x, rest...) : result.value;
}

/// `count` numbers of type T, as in a vector register
template <class T, int count>
struct Vector {
  typedef T Type __attribute__((vector_size(count * sizeof(T))));
  T of[count];
  Vector() {}
  explicit Vector(Type x) { memcpy(of, &x, sizeof of); }
  Type packed() const {
    Type x;
    memcpy(&x, of, sizeof x);
    return x;
  }
};

typedef Vector<double, 2>::Type double2;
typedef Vector<double, 4>::Type double4;
typedef Vector<double, 8>::Type double8;
typedef Vector<float, 4>::Type float4;
typedef Vector<float, 8>::Type float8;
typedef Vector<float, 16>::Type float16;

/// Bit-identical to one() for `count` cells; written so that compilers vectorise the first loop.
template <class Function, class T, int count, class... Rest>
[[gnu::flatten]] typename Vector<T, count>::Type of_each(const Vector<T, count>& x, const Rest&... rest) {
  using Bits = typename decltype(functions_of(T()))::Bits;
  Vector<T, count> y;
  Bits far[count], any = 0;
  for (int lane = 0; lane < count; ++lane) {
    const auto result = Function::near(functions_of(x.of[lane]), x.of[lane], rest.of[lane]...);
    y.of[lane] = result.value;
    far[lane] = result.far;
    any |= result.far;
  }
  if (__builtin_expect(any != 0, 0)) {
    for (int lane = 0; lane < count; ++lane) {
      if (far[lane] != 0) y.of[lane] = Function::library(x.of[lane], rest.of[lane]...);
    }
  }
  return y.packed();
}
template <class Function, class T, int count, class... Packed>
typename Vector<T, count>::Type several(Packed... packed) {
  return of_each<Function>(Vector<T, count>(packed)...);
}

}  // namespace
}  // namespace elementary
}  // namespace dpde
