// SPDX-License-Identifier: Apache-2.0
// Losses, tests and observables: numbers that are linear in mean, sum and integral become one sum over the cells.
#pragma once

#include "model/model.h"
#include "source/diagnostic.h"
#include "stencil/discretise.h"

namespace dpde::stencil {

/// Reports a value that is not a combination of reductions with factors that are the same everywhere.
void check_quantity(const model::Expr& value, const Origin& origin, DiagnosticSink& sink);

/// What each cell adds to the sum that is `value`, a checked one: mean(e) gives e/cells, sum(e) gives e, integral(e)
/// gives e*hx*hy*hz, a number c gives c/cells.
Expr cell_share(const model::Expr& value, int rank, Discretiser& at_point);

}  // namespace dpde::stencil
