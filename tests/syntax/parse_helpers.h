// SPDX-License-Identifier: Apache-2.0
// Short ways to parse, for the tests of this folder.
#pragma once

#include <fmt/format.h>

#include <string>

#include "source/diagnostic.h"
#include "source/source_file.h"
#include "syntax/parser.h"
#include "syntax/print/print_ast.h"

namespace dpde::ast {

/// One line for each diagnostic: 3:5 E0201 message | hint
inline std::string problems(const SourceFile& source, const DiagnosticSink& sink) {
  std::string text;
  for (const Diagnostic& diagnostic : sink.all()) {
    const LineColumn place = source.locate(diagnostic.range.begin);
    text += fmt::format("{}:{} {} {}", place.line, place.column, diagnostic.kind->code, diagnostic.message);
    text += diagnostic.hint.empty() ? "\n" : fmt::format(" | {}\n", diagnostic.hint);
  }
  return text;
}

inline std::string problems_of(const std::string& text) {
  const SourceFile source("t.dpde", text);
  DiagnosticSink sink;
  parse(source, sink);
  return problems(source, sink);
}

/// The canonical text, or the problems.
inline std::string formatted(const std::string& text) {
  const SourceFile source("t.dpde", text);
  DiagnosticSink sink;
  const File file = parse(source, sink);
  return sink.all().empty() ? print(file) : problems(source, sink);
}

inline std::string formatted_expression(const std::string& text) {
  const SourceFile source("t.dpde", text);
  DiagnosticSink sink;
  const Expr expr = parse_expression(source, sink);
  return sink.all().empty() ? print(expr) : problems(source, sink);
}

}  // namespace dpde::ast
