// SPDX-License-Identifier: Apache-2.0
// Removes stretched axes: below this level everything uses the uniform coordinate s of each axis. The positions are y =
// Y(s). The metric m = ds/dy = 1/Y'(s) is an additional coefficient (y_metric):
//
//   y                        Y(s)
//   dy(f)                    m*ds(f), orders above 1 nested: m*ds(m*ds(f)), the compact flux form
//   v . grad                 components v*m
//   hy                       hy/m, the spacing where it is asked for
//   mean(f), integral(f)     of c*f/m, c such that mean(1) = 1 to rounding; sums are not weighted
//   gradient(g) at a wall    g/m there
//   mixed(a, b, c)           mixed(a, b*m, c)
//   linear, outflow          line(a) between cells, a = (metric between the two cells next to the wall)/(metric on it):
//                            the second derivative of a straight line in y is 0 there; on faces unchanged
//
// A sum of m*(flux[+1/2] - flux[-1/2])/h, weighted by h/m, telescopes: quantities conserved on uniform grids stay
// conserved. On a wall the metric has its exact value, so the fluxes through walls are those of the boundary
// conditions. For staggered fields the metric is interpolated to the required placement.
//
//   size of a cell in inject   the weight of integrals, at the placement of the equation
//   sample(f, at = y)          at s(y); s is linear in y between the points of f and the walls
#pragma once

#include <string>

#include "model/model.h"

namespace dpde::model {

/// Parameters for the cell size along a stretched axis and for the uniform spacing (see above); a file cannot have such
/// names.
std::string size_name(const Axis& axis);
std::string uniform_spacing_name(const Axis& axis);

/// Whether the problem has a value of this name.
bool is_taken(const Problem& problem, const std::string& name);

/// Whether a coefficient of a problem in uniform coordinates is the metric of one of its axes.
bool is_metric(const Problem& problem, const Coefficient& coefficient);

/// The problem in uniform coordinates; unchanged if no axis is stretched.
Problem in_uniform_coordinates(Problem problem);

}  // namespace dpde::model
