// SPDX-License-Identifier: Apache-2.0
// Formulas of numbers and a single coordinate, as those of stretched axes: their values and their slopes. Slopes also
// of those of parameters and more coordinates.
#pragma once

#include <array>
#include <optional>

#include "model/model.h"

namespace dpde::model {

/// Whether it is made of numbers and coordinates alone.
bool is_formula(const Expr& e);
double value_at(const Expr& formula, double coordinate);
/// Of formulas of several coordinates, at a place.
double value_at(const Expr& formula, const std::array<double, 3>& place);
bool depends_on_axis(const Expr& formula, int axis);

/// `formula` with `place` in the part of the coordinate.
Expr at_place(const Expr& formula, const Expr& place);

/// What a derivative is by: the coordinate of an axis, or t; nothing: the only coordinate there is.
struct Variable {
  std::optional<int> axis = {};
  bool is_time = false;
};
/// The derivative by a coordinate. At a tie max and min have the slope of their second argument.
Expr slope_of(const Expr& formula, const Variable& by = {});

}  // namespace dpde::model
