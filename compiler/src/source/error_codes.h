// SPDX-License-Identifier: Apache-2.0
// The registry: everything the compiler and the command may ever complain about. One row a kind.
// E01xx characters, E02xx syntax, E03xx names and types, E04xx grid, boundary and time, E05xx schemes,
// E06xx derivatives, E07xx tasks and data, E08xx runs, E09xx files and machine, W0xxx warnings.
// Messages: lower case, one sentence, no stop, the user's words. tests/diagnostics triggers every row.
#pragma once

#include <string_view>

namespace dpde {

enum class Severity { warning, error };

struct DiagnosticKind {
  std::string_view code;
  std::string_view name;
  Severity severity;
  std::string_view message;
};

inline constexpr DiagnosticKind diagnostic_kinds[] = {
    {"E0101", "unexpected-character", Severity::error, "unexpected character {}"},
    {"E0102", "unterminated-text", Severity::error, "text without a closing quote"},
    {"E0103", "bad-number", Severity::error, "number {} is out of range"},
};

/// The row called `name`; a name that is not in the table does not compile.
consteval const DiagnosticKind* find_kind(std::string_view name) {
  for (const DiagnosticKind& kind : diagnostic_kinds) {
    if (kind.name == name) return &kind;
  }
  throw "no diagnostic kind of this name";
}

}  // namespace dpde
