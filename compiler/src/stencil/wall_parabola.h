// SPDX-License-Identifier: Apache-2.0
// What losses, observables and tests take for values beyond a wall that has a value.
#pragma once

#include "stencil/lowering.h"

namespace dpde::stencil {

/// The mirror image 2a - u, by which equations are of order 2, errs by h^2*u''/4: a second derivative of it is off by a
/// quarter, on the finest grid too. Here a point beyond the wall has the value of the parabola through the wall's and
/// those of two cells inside; with one cell the image stays.
Stage with_parabolas_at_walls(const Lowering& lowering, Stage stage);

}  // namespace dpde::stencil
