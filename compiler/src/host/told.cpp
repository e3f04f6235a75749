// SPDX-License-Identifier: Apache-2.0
#include "host/told.h"

#include <string_view>
#include <utility>

#include "source/render.h"

namespace dpde::host {

namespace {

ErrorKind kind_of(const Diagnostic& diagnostic) {
  const std::string_view code = diagnostic.kind->code;
  if (code == "E0902" || code == "E0903" || code == "E0910") return ErrorKind::machine;
  return code.starts_with("E08") ? ErrorKind::run : ErrorKind::input;
}

}  // namespace

Told told(const SourceFile& source, const DiagnosticSink& sink) {
  Told result;
  for (const Diagnostic& diagnostic : sink.all()) {
    const bool has_place = diagnostic.range.is_known();
    const LineColumn place = has_place ? source.locate(diagnostic.range.begin) : LineColumn{};
    const bool is_error = diagnostic.kind->severity == Severity::error;
    result.messages.push_back({std::string(diagnostic.kind->code), is_error ? "error" : "warning", diagnostic.message,
                               has_place ? source.path_of(diagnostic.range.begin) : "", place.line, place.column,
                               diagnostic.hint});
    result.text += render_text(source, diagnostic);
    if (is_error && !result.kind) result.kind = kind_of(diagnostic);
  }
  return result;
}

void fail(const SourceFile& source, const DiagnosticSink& sink) {
  Told all = told(source, sink);
  throw Error(all.kind.value_or(ErrorKind::machine), all.text, std::move(all.messages));
}

}  // namespace dpde::host
