// SPDX-License-Identifier: Apache-2.0
// What the programs of a scene take from it.
#pragma once

#include "model/model.h"
#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::driver {

/// Reports parameters without a value. Those of the step have one: the model level says which have not. Other programs
/// of the text may take more.
void check_values(const ast::File& file, const model::Problem& problem, const stencil::Module& module,
                  DiagnosticSink& sink);

}  // namespace dpde::driver
