// SPDX-License-Identifier: Apache-2.0
// What the compiler knows of a text: its tree as far as it can be read, the messages, what its scenes and tasks are.
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

/// Names and types alone, or lowered and differentiated as by `dpde check`, which takes seconds where scenes are many.
enum class Depth { model, derivatives };

/// Never throws: what the compiler throws becomes a message. `is_interrupted` is asked between scenes.
Understood understand(const std::string& path, const std::string& text, Depth depth,
                      const std::function<bool()>& is_interrupted = {});

}  // namespace dpde::lsp
