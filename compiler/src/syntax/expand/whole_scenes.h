// SPDX-License-Identifier: Apache-2.0
// Scenes that are written as another with changes, `scene fine = plain { cells 64 }`, written out.
#pragma once

#include <optional>

#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::ast {

/// Each such scene with all items of its own. What it says stands in the place of what the other says of the same
/// thing: of an axis, a parameter, the initial state of a field, a side of a boundary, the time, what is stored. Events
/// are added. nullopt after a diagnostic: a scene of one that is not there, or of itself.
std::optional<File> with_whole_scenes(File file, DiagnosticSink& sink);

}  // namespace dpde::ast
