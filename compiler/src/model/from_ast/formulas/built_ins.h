// SPDX-License-Identifier: Apache-2.0
// The functions and operators of the language: a row holds all that the compiler knows of one. A new word is a row, the
// two functions that it names, and a line of the manual's table.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/formulas/measures.h"

namespace dpde::model::formulas {

struct BuiltIn {
  /// Formulas that are evaluated at all points of the grid: of equations, events, observables, losses and tests.
  enum class Needs { nothing, points, points_of_derivative };

  std::string_view name;
  /// The call as a formula of the model; none after a diagnostic.
  TypedExpr (*elaborate)(FormulaScope& here, const ast::Call& e, SourceRange range);
  /// The unit of the call, which has at least one argument. Reports arguments whose units do not fit.
  MeasureList (*unit)(Measures& measures, const ast::Call& e, SourceRange range);
  Needs needs = Needs::nothing;
  bool is_suggested = true;  // where an unknown name is like it
};

/// nullptr where the language has no such function.
const BuiltIn* find_built_in(std::string_view name);
/// Those that are suggested.
std::vector<std::string> function_names();

}  // namespace dpde::model::formulas
