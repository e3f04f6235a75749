// SPDX-License-Identifier: Apache-2.0
// The compiler's analysis of a text: its tree as far as it is readable, the messages, its scenes and tasks.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"
#include "source/source_file.h"
#include "syntax/ast.h"

namespace dpde::lsp {

struct Understood {
  SourceFile source{"", ""};  // with its imports
  ast::File file;             // likewise
  std::vector<Diagnostic> diagnostics;
  std::map<std::string, model::Problem> problems;  // by scene and task
  bool is_whole = true;                            // false: it was interrupted

  bool has_errors() const;
};

/// Names and types only, or lowered and differentiated as by `dpde check`, which takes seconds with many scenes.
enum class Depth { model, derivatives };

/// Never throws: exceptions of the compiler become messages. `is_interrupted` is called between scenes.
Understood understand(const std::string& path, const std::string& text, Depth depth,
                      const std::function<bool()>& is_interrupted = {});

}  // namespace dpde::lsp
