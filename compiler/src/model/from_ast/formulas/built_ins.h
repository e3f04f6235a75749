// SPDX-License-Identifier: Apache-2.0
// The functions and operators of the language, one row each with all their properties. A new word needs a row, the two
// functions named in it, and a line in the manual's table.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/from_ast/formulas/formula_scope.h"

namespace dpde::model::formulas {

struct BuiltIn {
  /// Restricts the word to formulas evaluated at all points of the grid: of equations, events, observables, losses and
  /// tests.
  enum class Needs { nothing, points, points_of_derivative };

  std::string_view name;
  /// Converts the call to a formula of the model; `none` after a diagnostic.
  TypedExpr (*elaborate)(FormulaScope& here, const ast::Call& e, SourceRange range);
  /// The unit of the call, which has at least one argument. Reports arguments with wrong units.
  MeasureList (*unit)(Measures& measures, const ast::Call& e, SourceRange range);
  Needs needs = Needs::nothing;
  bool is_suggested = true;  // for similar unknown names
};

/// nullptr if the language has no such function.
const BuiltIn* find_built_in(std::string_view name);
/// Names of the suggested functions.
std::vector<std::string> function_names();

}  // namespace dpde::model::formulas
