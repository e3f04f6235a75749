// SPDX-License-Identifier: Apache-2.0
// Values and slopes of formulas of numbers and one coordinate, as those of stretched axes. Slopes are also available
// for formulas with parameters and several coordinates.
#pragma once

#include <array>
#include <optional>

#include "model/model.h"

namespace dpde::model {

/// Whether it contains only numbers and coordinates.
bool is_formula(const Expr& e);
double value_at(const Expr& formula, double coordinate);
/// A formula of several coordinates, at one point.
double value_at(const Expr& formula, const std::array<double, 3>& place);
bool depends_on_axis(const Expr& formula, int axis);

/// `formula` with the coordinate replaced by `place`.
Expr at_place(const Expr& formula, const Expr& place);

/// Variable of a derivative: the coordinate of an axis, or t; by default the only coordinate.
struct Variable {
  std::optional<int> axis = {};
  bool is_time = false;
};
/// The derivative by a coordinate, by the table of support/maths/derivatives.h: at kinks too it is that of adjoints.
Expr slope_of(const Expr& formula, const Variable& by = {});

}  // namespace dpde::model
