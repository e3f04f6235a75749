// SPDX-License-Identifier: Apache-2.0
// Schemes that reach farther than a grid has cells: sums over images are exact sums, but of no order.
#pragma once

#include "model/model.h"
#include "source/diagnostic.h"
#include "stencil/stencil.h"

namespace dpde::driver {

/// A warning for each axis along which some kernel of the program reads more cells in a row than there are. Nothing is
/// said of formulas of two and three points, and of a ring of one cell, along which all differences are 0.
void tell_wide_formulas(const stencil::Module& module, const stencil::Program& program, const model::Problem& problem,
                        DiagnosticSink& sink);

}  // namespace dpde::driver
