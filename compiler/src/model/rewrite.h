// SPDX-License-Identifier: Apache-2.0
// All formulas of a problem that stand in its coordinates, for changes of coordinates.
#pragma once

#include <functional>

#include "model/model.h"

namespace dpde::model {

/// What becomes of a formula of a field at this placement; of formulas that belong to no field, at the centres.
using FormulaRule = std::function<Expr(const Expr&, const Placement&)>;
/// In the place of each formula what the rule makes of it; all but those of boundaries, which change with their sides,
/// and those that say what coordinates are.
void rewrite_in_coordinates(Problem& problem, const FormulaRule& rule);

}  // namespace dpde::model
