// SPDX-License-Identifier: Apache-2.0
// Models of a file without a scene: their mistakes, although there is no grid to lower them to.
#pragma once

#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::driver {

/// Reports what is wrong with the models themselves on the number of axes that suits each best.
void check_lone_models(const ast::File& file, const SourceFile& source, DiagnosticSink& sink);

}  // namespace dpde::driver
