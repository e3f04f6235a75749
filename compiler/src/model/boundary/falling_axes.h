// SPDX-License-Identifier: Apache-2.0
// Axes that run down, grid x = 4 .. 0, done with at this level: everything below runs on the coordinate s = 4 - x,
// which rises with the number of the cell.
//
//   x                        4 - s
//   dx(f)                    -ds(f); signs go outwards, so that dx(k*dx(f)) is ds(k*ds(f))
//   v . grad                 the component along x negated
//   f one cell on            one cell back
//   sample(f, at = x)        at 4 - x; the point above is the one below
//   x.low, x.high            the high and the low side of s; n points outwards in both
//
// Components of vectors keep their values. Fields on faces have their values on the upper faces in s, so that they hold
// the wall where x is low, not the one where it is high: the flow leaves there (`outflow`).
#pragma once

#include "model/model.h"

namespace dpde::model {

/// The problem in coordinates that rise; itself where no axis runs down.
Problem in_rising_coordinates(Problem problem);

}  // namespace dpde::model
