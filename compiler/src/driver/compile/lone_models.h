// SPDX-License-Identifier: Apache-2.0
// Checks the models of a file without a scene, although there is no grid to lower them to.
#pragma once

#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::driver {

/// Reports the errors of each model. The number of axes is chosen to suit the model.
void check_lone_models(const ast::File& file, const SourceFile& source, DiagnosticSink& sink);

}  // namespace dpde::driver
