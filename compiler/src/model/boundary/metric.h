// SPDX-License-Identifier: Apache-2.0
// Sizes of cells, in coordinates that are no lengths too: what integrals and means weigh values by.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::model {

/// Of a unit of all coordinates: the product of all scales and the way around.
Expr volume_of(const Metric& metric);
/// The same over some of the axes: lines and faces have no way around.
Expr size_of(const Metric& metric, const std::array<bool, 3>& over, std::size_t axes);

/// Whether all of the side where the place is low, or high, is one point: a unit of another coordinate has no length
/// there.
bool is_pole_at(const Problem& problem, std::size_t axis, bool is_low);

bool has_pole(const Problem& problem);

/// As the scene's coordinates call it: lat; else x, y, z.
std::string name_of_axis(const Problem& problem, std::size_t axis);
/// "lat.low": as side_name has it.
std::string name_of_side(const Problem& problem, std::size_t axis, bool is_low);

/// Whether a formula of coordinates, a length or made of lengths, is 0 on that side; false of other expressions.
bool vanishes_at(const Problem& problem, const Expr& length, std::size_t axis, bool is_low);

/// Whether a formula of coordinates falls to 0 faster than lengths do towards each pole.
bool falls_towards_poles(const Problem& problem, const Expr& factor);

/// Of a unit of coordinate `around`: what is shorter lies on a pole at an end of `axis`.
double length_of_poles(const Problem& problem, std::size_t axis, std::size_t around);

/// Whether a value depends on what lies beyond a pole: not where that is only in fluxes through faces of no size. A
/// solve knows no cell that is half a turn away.
bool reads_across_pole(const Problem& problem, const Expr& e);

/// The mean of a formula of coordinates over all points of a placement, as `mean` has it where axes are stretched.
double mean_of(const Expr& formula, const std::vector<Axis>& axes, const Placement& placement);

/// Volumes of the cells, x fastest; values at faces stand for what lies between the centres on both sides of them.
std::vector<double> cell_volumes(const std::vector<Axis>& axes, const std::optional<Metric>& metric,
                                 const Placement& placement);

}  // namespace dpde::model
