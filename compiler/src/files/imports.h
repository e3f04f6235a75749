// SPDX-License-Identifier: Apache-2.0
// import "flow.dpde": files that stand behind the one that names them.
#pragma once

#include <string>

#include "source/diagnostic.h"
#include "source/source_file.h"

namespace dpde::files {

/// `source` with the files that it imports behind it, and those that they import, each once. Paths are relative to the
/// file that imports. Reports cannot-read and cyclic-import. Mistakes in the text of the files are left to whoever
/// parses it.
SourceFile with_imports(SourceFile source, DiagnosticSink& sink);

/// The same blocks as one file without imports; the text itself where there are none.
std::string text_without_imports(const SourceFile& source);

}  // namespace dpde::files
