// SPDX-License-Identifier: Apache-2.0
// Losses, tests and observables: an expression that is linear in mean, sum and integral becomes one sum over the cells.
#pragma once

#include "model/model.h"
#include "stencil/space/discretise.h"

namespace dpde::stencil {

/// Contribution of each cell to `value`: mean(e) gives e/cells, sum(e) gives e, integral(e) gives e*hx*hy*hz, a number
/// c gives c/cells.
Expr cell_share(const model::Expr& value, int rank, Discretiser& at_point);

}  // namespace dpde::stencil
