// SPDX-License-Identifier: Apache-2.0
// Structured diagnostics, collected in a sink. Every kind stands in error_codes.h.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

#include "source/error_codes.h"
#include "source/source_file.h"

namespace dpde {

/// A second place that explains the first.
struct Note {
  SourceRange range;
  std::string text;
};

struct Diagnostic {
  const DiagnosticKind* kind = nullptr;
  std::string message;  ///< the kind's text with its {} replaced
  SourceRange range;
  std::string hint;  ///< what to write instead; may be empty
  std::vector<Note> notes;
};

/// Names a kind of the registry; an unknown name does not compile.
struct KindRef {
  consteval KindRef(const char* name) : kind(find_kind(name)) {}
  const DiagnosticKind* kind;
};

class DiagnosticSink {
 public:
  /// Records one diagnostic; `arguments` replace the {} of the kind's message in order. At most 20 errors are kept.
  /// The reference returned is valid until the next report: use it to add a hint or notes.
  Diagnostic& report(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments = {},
                     std::string hint = {});
  bool has_errors() const { return error_count_ > 0; }
  const std::vector<Diagnostic>& all() const { return diagnostics_; }

 private:
  std::vector<Diagnostic> diagnostics_;
  Diagnostic overflow_;
  int error_count_ = 0;
};

/// The nearest of `candidates` to `name` for a "did you mean", or "" when none is near (edit distance).
std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace dpde
