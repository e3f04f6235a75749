// SPDX-License-Identifier: Apache-2.0
// import "flow.dpde": the imported file is appended to the importing one.
#pragma once

#include <string>

#include "source/diagnostic.h"
#include "source/source_file.h"

namespace dpde::files {

/// `source` followed by all files it imports, directly or indirectly, each once. Paths are relative to the importing
/// file. Reports cannot-read and cyclic-import. Errors in the text of the files are reported when it is parsed.
SourceFile with_imports(SourceFile source, DiagnosticSink& sink);

/// The same blocks as a single file without imports; the unchanged text if there are none.
std::string text_without_imports(const SourceFile& source);

}  // namespace dpde::files
