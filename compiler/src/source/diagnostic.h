// SPDX-License-Identifier: Apache-2.0
// Structured diagnostics, collected in a sink. error_codes.h has all kinds.
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

/// A second source position that explains the first.
struct Note {
  SourceRange range;
  std::string text;
};

struct Diagnostic {
  const DiagnosticKind* kind = nullptr;
  std::string message;  ///< the kind's text with its {} replaced
  SourceRange range;
  std::string hint;  ///< advice; may be empty
  std::vector<Note> notes;
};

/// Refers to a kind of the registry by name; an unknown name does not compile.
struct KindRef {
  consteval KindRef(const char* name) : kind(find_kind(name)) {}
  const DiagnosticKind* kind;
};

/// Advice: a text, or a function that makes it if the diagnostic is kept.
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
  /// Records a diagnostic; `arguments` replace the {} of the kind's message in order. At most 20 errors are kept. The
  /// returned reference is valid until the next report; use it to add a hint or notes.
  Diagnostic& report(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments = {},
                     const Hint& hint = {});
  /// Adds a diagnostic of another sink.
  void add(const Diagnostic& diagnostic);
  bool has_errors() const { return error_count_ > 0; }
  /// Whether further errors are only counted.
  bool is_full() const;
  const std::vector<Diagnostic>& all() const { return diagnostics_; }

 private:
  std::vector<Diagnostic> diagnostics_;
  Diagnostic overflow_;
  int error_count_ = 0;
};

/// The candidate closest to `name` (edit distance), for "did you mean"; "" if none is close.
std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace dpde
