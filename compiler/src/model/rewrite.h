// SPDX-License-Identifier: Apache-2.0
// All formulas of a problem that depend on coordinates, for changes of coordinates.
#pragma once

#include <functional>

#include "model/model.h"

namespace dpde::model {

/// The new formula for a field at this placement; cell centres for formulas without a field.
using FormulaRule = std::function<Expr(const Expr&, const Placement&)>;
/// Replaces each formula by the rule's result. Excluded: formulas of boundaries, which change with their sides, and
/// formulas that define coordinates.
void rewrite_in_coordinates(Problem& problem, const FormulaRule& rule);

}  // namespace dpde::model
