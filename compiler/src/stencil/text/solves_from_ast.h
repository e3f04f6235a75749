// SPDX-License-Identifier: Apache-2.0
// Heads of solves, and the fields named by items of programs.
#pragma once

#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// The solve without its block.
Solve read_solve_head(const ast::SolveItem& source, DiagnosticSink& sink);

/// Fields named by the item itself, without those of its block or of the kernel it runs.
std::vector<std::string> fields_named(const ast::Item& item);

}  // namespace dpde::stencil
