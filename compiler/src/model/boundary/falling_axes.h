// SPDX-License-Identifier: Apache-2.0
// Removes descending axes, grid x = 4 .. 0: below this level everything uses the coordinate s = 4 - x, which increases
// with the cell number.
//
//   x                        4 - s
//   dx(f)                    -ds(f); signs go outwards, so that dx(k*dx(f)) is ds(k*ds(f))
//   v . grad                 the component along x negated
//   f one cell on            one cell back
//   sample(f, at = x)        at 4 - x; the point above is the one below
//   x.low, x.high            the high and the low side of s; n points outwards in both
//
// Vector components keep their values. Fields on faces have values on the upper faces in s: on the wall at low x, not
// on the one at high x, where outflow applies (`outflow`).
#pragma once

#include "model/model.h"

namespace dpde::model {

/// The problem in ascending coordinates; unchanged if no axis descends.
Problem in_rising_coordinates(Problem problem);

}  // namespace dpde::model
