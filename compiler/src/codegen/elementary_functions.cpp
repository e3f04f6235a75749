// SPDX-License-Identifier: Apache-2.0
#include "codegen/elementary_functions.h"

#include "support/assert.h"

namespace dpde::codegen {

bool is_elementary(Fn fn) {
  switch (fn) {
    case Fn::sin:
    case Fn::cos:
    case Fn::tan:
    case Fn::asin:
    case Fn::acos:
    case Fn::atan:
    case Fn::sinh:
    case Fn::cosh:
    case Fn::tanh:
    case Fn::exp:
    case Fn::log:
    case Fn::erf: return true;
    case Fn::sqrt:
    case Fn::abs:
    case Fn::sign:
    case Fn::floor:
    case Fn::fraction:
    case Fn::min:
    case Fn::max: return false;
  }
  unreachable("function");
}

}  // namespace dpde::codegen
