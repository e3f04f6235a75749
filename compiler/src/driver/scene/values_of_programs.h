// SPDX-License-Identifier: Apache-2.0
// Checks the parameter values that a scene gives to its programs.
#pragma once

#include "model/model.h"
#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::driver {

/// Reports parameters without a value. The model level checks those of the step; other hand-written programs may take
/// more.
void check_values(const ast::File& file, const model::Problem& problem, const stencil::Module& module,
                  DiagnosticSink& sink);

}  // namespace dpde::driver
