// SPDX-License-Identifier: Apache-2.0
// Formulas of numbers and a single coordinate, as those of stretched axes: their values and their slopes.
#pragma once

#include "model/model.h"

namespace dpde::model {

double value_at(const Expr& formula, double coordinate);

/// `formula` with `place` in the part of the coordinate.
Expr at_place(const Expr& formula, const Expr& place);

/// The derivative by the coordinate. At a tie max and min have the slope of their second argument.
Expr slope_of(const Expr& formula);

}  // namespace dpde::model
