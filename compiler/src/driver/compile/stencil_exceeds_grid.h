// SPDX-License-Identifier: Apache-2.0
// Warns of stencils wider than the grid. With ghost values such sums are still conservative, but have no order of
// accuracy.
#pragma once

#include "model/model.h"
#include "source/diagnostic.h"
#include "stencil/stencil.h"

namespace dpde::driver {

/// Warns for each axis along which a kernel of the program reads more adjacent cells than the axis has. Not for
/// stencils of two and three points, nor for a periodic axis of one cell, along which all differences are 0.
void tell_wide_formulas(const stencil::Module& module, const stencil::Program& program, const model::Problem& problem,
                        DiagnosticSink& sink);

}  // namespace dpde::driver
