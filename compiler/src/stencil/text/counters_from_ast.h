// SPDX-License-Identifier: Apache-2.0
// Names of the counters of repeats in hand-written programs.
#pragma once

#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// Reports each counter whose name is not unique in the program. `fields`: the fields of the program.
void check_counters(const Module& module, const Program& program, const ast::Program& source,
                    const std::vector<std::string>& fields, DiagnosticSink& sink);

}  // namespace dpde::stencil
