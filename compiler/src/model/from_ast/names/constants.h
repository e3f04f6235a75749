// SPDX-License-Identifier: Apache-2.0
// Values of expressions made of numbers and parameters.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "model/model.h"

namespace dpde::model {

struct Value {
  double number = 0;
  std::string mistake;  // "division by zero", ...; "" when the number is finite
  SourceRange at;       // of the mistake
};

/// `values` has all parameters of `e`; fields, coordinates and reductions do not occur. For messages: what goes on into
/// the problem is asked of made_once.
Value value_of(const Expr& e, const std::map<std::string, std::optional<double>>& values);

}  // namespace dpde::model
