// SPDX-License-Identifier: Apache-2.0
// Expands scenes derived from another one with changes, `scene fine = plain { cells 64 }`.
#pragma once

#include <optional>

#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::ast {

/// Gives each derived scene all items of its own. Its items replace those of the base scene on the same subject: an
/// axis, a parameter, the initial state of a field, a side of a boundary, the time, the outputs. Events are added.
/// Returns nullopt after a diagnostic, if the base scene does not exist or the derivation is circular.
std::optional<File> with_whole_scenes(File file, DiagnosticSink& sink);

}  // namespace dpde::ast
