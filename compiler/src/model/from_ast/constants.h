// SPDX-License-Identifier: Apache-2.0
// Values of expressions made of numbers and parameters.
#pragma once

#include <array>
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

/// `values` has all parameters of `e`; fields, coordinates and reductions do not occur.
Value value_of(const Expr& e, const std::map<std::string, std::optional<double>>& values);
/// The same where coordinates are in it, at a place; nullopt where something else is, or a parameter without a value.
std::optional<double> value_at(const Expr& e, const std::map<std::string, std::optional<double>>& values,
                               const std::array<double, 3>& place);

}  // namespace dpde::model
