// SPDX-License-Identifier: Apache-2.0
// Structured diagnostics, collected in a sink. Every kind stands in error_codes.h.
#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
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

/// What to write instead: a text, or a function that makes it where the diagnostic is kept.
class Hint {
 public:
  Hint() = default;
  Hint(const char* text) : text_(text) {}
  Hint(std::string text) : text_(std::move(text)) {}
  template <class F>
  requires std::is_invocable_r_v<std::string, const F&> Hint(F make) : make_(std::move(make)) {}
  std::string text() const { return make_ ? make_() : text_; }

 private:
  std::string text_;
  std::function<std::string()> make_;
};

class DiagnosticSink {
 public:
  /// Records one diagnostic; `arguments` replace the {} of the kind's message in order. At most 20 errors are kept.
  /// The reference returned is valid until the next report: use it to add a hint or notes.
  Diagnostic& report(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments = {},
                     const Hint& hint = {});
  /// One that another sink has.
  void add(const Diagnostic& diagnostic);
  bool has_errors() const { return error_count_ > 0; }
  /// Further errors are counted only.
  bool is_full() const;
  const std::vector<Diagnostic>& all() const { return diagnostics_; }

 private:
  std::vector<Diagnostic> diagnostics_;
  Diagnostic overflow_;
  int error_count_ = 0;
};

/// The nearest of `candidates` to `name` for a "did you mean", or "" when none is near (edit distance).
std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace dpde
