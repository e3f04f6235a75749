// SPDX-License-Identifier: Apache-2.0
// Sources of a point's error. Companion runs on the same grid with half and quarter steps give the error of the steps
// and its order q. Runs on twice and half the cell width, with a step stable on all of them, give the error of the
// cells and its order p. A run in double precision gives that of rounding. With iterative solves, all of these use a
// hundredth of the tolerance, and one more run with the point's own tolerance gives the error of solves:
//
//   E_time  = (u(h, dt) - u(h, dt/2))/(1 - 2^-q),   2^q = |u(h, dt) - u(h, dt/2)|/|u(h, dt/2) - u(h, dt/4)|
//   E_space = (u(h, dt') - u(h/2, dt'))/(1 - 2^-p), 2^p = |u(2h, dt') - u(h, dt')|/|u(h, dt') - u(h/2, dt')|
//
// (L. F. Richardson, The deferred approach to the limit, Phil. Trans. A 226, 1927.)
#pragma once

#include "chart/point.h"

namespace dpde::chart {

/// For a point that ran. Exceptions become the budget's failure.
Budget budget_of(const SourceFile& source, const PointOptions& options, const Point& point);

}  // namespace dpde::chart
