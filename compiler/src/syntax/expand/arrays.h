// SPDX-License-Identifier: Apache-2.0
// Arrays of fields, parameters and the like, `field c[3]`, written out: c[1] is a field of its own, called c_1.
#pragma once

#include <optional>

#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::ast {

/// A line about c[i] stands for as many as c has elements, one about c, where it gives something to fields or
/// parameters, for all of them; sum(a[j]*c[j], j) is a sum over j. Blocks know the arrays of their models. nullopt
/// after a diagnostic.
std::optional<File> with_elements(File file, DiagnosticSink& sink);

}  // namespace dpde::ast
