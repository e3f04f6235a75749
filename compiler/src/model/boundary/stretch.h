// SPDX-License-Identifier: Apache-2.0
// Stretched axes, done with at this level: everything below runs on the uniform coordinate s of each axis. With the
// places y = Y(s) and the metric m = ds/dy = 1/Y'(s), a coefficient beside those of the model (y_metric):
//
//   y                        Y(s)
//   dy(f)                    m*ds(f), orders above 1 nested: m*ds(m*ds(f)), the compact flux form
//   v . grad                 components v*m
//   hy                       hy/m, the spacing where it is asked for
//   mean(f), integral(f)     of c*f/m, c such that mean(1) = 1 to rounding; sums are not weighted
//   gradient(g) at a wall    g/m there
//   mixed(a, b, c)           mixed(a, b*m, c)
//   linear, outflow          line(a) between cells, a the metric between the two beside the wall over that on it: of a
//                            straight line in y the second derivative is 0 there; on faces they stay
//
// A sum of m*(flux[+1/2] - flux[-1/2])/h, weighted by h/m, telescopes: what is conserved on uniform grids stays
// conserved. On a wall the metric has its own value there exactly, so that fluxes through walls are those that
// conditions give. Where fields are staggered the metric is interpolated to where it is wanted.
//
//   the size of a cell in inject   what integral weighs values by, at the placement of the equation
//   sample(f, at = y)              at s(y), where both are linear in one another between the points of f and the walls
#pragma once

#include <string>

#include "model/model.h"

namespace dpde::model {

/// The parameters that stand, above, for the size of a cell along a stretched axis and for the uniform spacing; no
/// names that a file could have.
std::string size_name(const Axis& axis);
std::string uniform_spacing_name(const Axis& axis);

/// Whether the problem has a value of this name.
bool is_taken(const Problem& problem, const std::string& name);

/// Whether a coefficient of a problem in uniform coordinates is the metric of one of its axes.
bool is_metric(const Problem& problem, const Coefficient& coefficient);

/// The problem in the uniform coordinates; itself where nothing is stretched.
Problem in_uniform_coordinates(Problem problem);

}  // namespace dpde::model
