// SPDX-License-Identifier: Apache-2.0
// Expands arrays of fields, parameters etc., `field c[3]`: c[1] becomes a field of its own, c_1.
#pragma once

#include <optional>

#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::ast {

/// A line about c[i] is repeated for all elements of c. A line about c as a whole, if it gives fields or parameters a
/// value, applies to all of them. sum(a[j]*c[j], j) is a sum over j. Blocks know the arrays of their models. Returns
/// nullopt after a diagnostic.
std::optional<File> with_elements(File file, DiagnosticSink& sink);

}  // namespace dpde::ast
