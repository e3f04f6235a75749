// SPDX-License-Identifier: Apache-2.0
#include "support/maths/evaluate.h"

#include <algorithm>
#include <cmath>

#include "support/assert.h"

namespace dpde {

double evaluate_call(Fn fn, double a, double b) {
  switch (fn) {
    case Fn::sin: return std::sin(a);
    case Fn::cos: return std::cos(a);
    case Fn::tan: return std::tan(a);
    case Fn::asin: return std::asin(a);
    case Fn::acos: return std::acos(a);
    case Fn::atan: return std::atan(a);
    case Fn::sinh: return std::sinh(a);
    case Fn::cosh: return std::cosh(a);
    case Fn::tanh: return std::tanh(a);
    case Fn::exp: return std::exp(a);
    case Fn::log: return std::log(a);
    case Fn::erf: return std::erf(a);
    case Fn::sqrt: return std::sqrt(a);
    case Fn::abs: return std::abs(a);
    case Fn::sign: return (a > 0) - (a < 0);
    case Fn::floor: return std::floor(a);
    case Fn::fraction: return a - std::floor(a);
    case Fn::min: return b < a ? b : a;
    case Fn::max: return a < b ? b : a;
  }
  unreachable("function");
}

}  // namespace dpde
