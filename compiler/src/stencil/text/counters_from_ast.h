// SPDX-License-Identifier: Apache-2.0
// Names by which repeats of a program that a person wrote count their passes.
#pragma once

#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// Each counter has a name of its own in the program, whose fields are given: an error at those that have not.
void check_counters(const Module& module, const Program& program, const ast::Program& source,
                    const std::vector<std::string>& fields, DiagnosticSink& sink);

}  // namespace dpde::stencil
