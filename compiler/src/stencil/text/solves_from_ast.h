// SPDX-License-Identifier: Apache-2.0
// How a solve is to be done, and the fields that items of programs name.
#pragma once

#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// All but the block.
Solve read_solve_head(const ast::SolveItem& source, DiagnosticSink& sink);

/// Those of the item itself, not of its block or of what it runs.
std::vector<std::string> fields_named(const ast::Item& item);

}  // namespace dpde::stencil
