// SPDX-License-Identifier: Apache-2.0
// Operators whose result is a condition.
#pragma once

#include "support/assert.h"
#include "support/vocabulary.h"

namespace dpde {

/// The switch has no default, so a new operator must be added here.
inline bool is_comparison(BinaryOp op) {
  switch (op) {
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal: return true;
    case BinaryOp::add:
    case BinaryOp::subtract:
    case BinaryOp::multiply:
    case BinaryOp::divide:
    case BinaryOp::power:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: return false;
  }
  unreachable("operator");
}

inline bool is_logical(BinaryOp op) { return op == BinaryOp::logical_and || op == BinaryOp::logical_or; }

}  // namespace dpde
