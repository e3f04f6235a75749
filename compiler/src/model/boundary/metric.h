// SPDX-License-Identifier: Apache-2.0
// Cell sizes, also in curvilinear coordinates: the weights of integrals and means.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::model {

/// The word of the language, `metric` for lengths that are given. And the system of a word; given for other words.
std::string word_of(CoordinateSystem system);
CoordinateSystem system_of(const std::string& word);

/// The product of all scales and of the length of the way around.
Expr volume_of(const Metric& metric);
/// The same over some of the axes; the way around counts only for volumes.
Expr size_of(const Metric& metric, const std::array<bool, 3>& over, std::size_t axes);

/// Whether the side at the low, or high, end of the positions is a single point: a unit of another coordinate has no
/// length there.
bool is_pole_at(const Problem& problem, std::size_t axis, bool is_low);

bool has_pole(const Problem& problem);

/// The name in the scene's coordinates: lat; else x, y, z.
std::string name_of_axis(const Problem& problem, std::size_t axis);
/// "lat.low", in the form of side_name.
std::string name_of_side(const Problem& problem, std::size_t axis, bool is_low);

/// Whether a length, a formula of coordinates, is 0 on that side; false for other expressions.
bool vanishes_at(const Problem& problem, const Expr& length, std::size_t axis, bool is_low);

/// Whether a formula of coordinates tends to 0 faster than lengths do towards each pole.
bool falls_towards_poles(const Problem& problem, const Expr& factor);

/// Threshold for the length of a unit of coordinate `around`: a shorter unit lies on a pole at an end of `axis`.
double length_of_poles(const Problem& problem, std::size_t axis, std::size_t around);

/// Whether a value depends on values beyond a pole. Fluxes through faces of area 0 do not count. A solve cannot read
/// the cell half a turn away.
bool reads_across_pole(const Problem& problem, const Expr& e);

/// The mean of a formula of coordinates over all points of a placement; like `mean` on stretched axes.
double mean_of(const Expr& formula, const std::vector<Axis>& axes, const Placement& placement);

/// Volumes of the cells, x fastest. The cell of a face reaches to the centres on both sides.
std::vector<double> cell_volumes(const std::vector<Axis>& axes, const std::optional<Metric>& metric,
                                 const Placement& placement);

}  // namespace dpde::model
