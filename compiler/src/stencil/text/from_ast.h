// SPDX-License-Identifier: Apache-2.0
// Hand-written kernels, programs and loops: ast to stencil. The inverse of print_stencil.
#pragma once

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// The kernels, programs and loops of `file`. Those with errors are reported and left out; other declarations are
/// ignored.
Module from_ast(const ast::File& file, DiagnosticSink& sink);

}  // namespace dpde::stencil
