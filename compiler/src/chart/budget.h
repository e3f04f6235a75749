// SPDX-License-Identifier: Apache-2.0
// Where the error of a point comes from. Companion runs on the same grid with halved and quartered steps tell the part
// of the steps and its order q, runs on doubled and halved cells with a step that all of them bear the part of the
// cells and its order p, a run in double precision that of rounding. Where equations are solved by steps, all of these
// come to a hundredth of the tolerance, and one more, to the point's own, tells the part of that:
//
//   E_time  = (u(h, dt) - u(h, dt/2))/(1 - 2^-q),   2^q = |u(h, dt) - u(h, dt/2)|/|u(h, dt/2) - u(h, dt/4)|
//   E_space = (u(h, dt') - u(h/2, dt'))/(1 - 2^-p), 2^p = |u(2h, dt') - u(h, dt')|/|u(h, dt') - u(h/2, dt')|
//
// (L. F. Richardson, The deferred approach to the limit, Phil. Trans. A 226, 1927.)
#pragma once

#include "chart/point.h"

namespace dpde::chart {

/// Of a point that ran. What is thrown is its failure.
Budget budget_of(const SourceFile& source, const PointOptions& options, const Point& point);

}  // namespace dpde::chart
