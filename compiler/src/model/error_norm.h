// SPDX-License-Identifier: Apache-2.0
// Norms of the errors of all cells.
#pragma once

#include "support/assert.h"

namespace dpde::model {

enum class ErrorNorm { l1, l2, linf };  // mean of |e|, root of the mean of e^2, largest |e|

inline const char* name_of(ErrorNorm norm) {
  switch (norm) {
    case ErrorNorm::l1: return "l1";
    case ErrorNorm::l2: return "l2";
    case ErrorNorm::linf: return "linf";
  }
  unreachable("norm of errors");
}

}  // namespace dpde::model
