// SPDX-License-Identifier: Apache-2.0
// Formats diagnostics as text (with source line and caret) and as JSON.
#pragma once

#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "source/source_file.h"
#include "support/json.h"

namespace dpde {

/// One diagnostic as text, ending in a line break:
///   wave.dpde:3:9: error[E0301]: message
///     the source line
///       ^~~~
///   help: what to write instead
/// Only the first line of a range is underlined; without a range there is no source line. Bytes that a terminal
/// cannot show appear as '?'.
std::string render_text(const SourceFile& file, const Diagnostic& diagnostic, bool colour = false);

/// Errors as above, and of the warnings of each kind the first one (the worst, if they are reported so), then how many
/// there are at which lines:
///   note: 3 more of W0804 (lines 3, 7): --all shows them
/// Warnings that are the same in all parts count once.
std::string render_kinds_once(const SourceFile& file, const std::vector<Diagnostic>& diagnostics,
                              const std::string& option, bool colour = false);

/// An array of {code, severity, message, file, line, column, hint}; line and column are 0 without a range.
Json diagnostics_json(const SourceFile& file, const std::vector<Diagnostic>& diagnostics);

}  // namespace dpde
