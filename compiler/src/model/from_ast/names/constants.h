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
  std::string mistake;  // "division by zero", ...; "" if the number is finite
  SourceRange at;       // of the mistake
};

/// `values` has all parameters of `e`; `e` has no fields, coordinates or reductions. For messages; values that enter
/// the problem come from made_once.
Value value_of(const Expr& e, const std::map<std::string, std::optional<double>>& values);

}  // namespace dpde::model
