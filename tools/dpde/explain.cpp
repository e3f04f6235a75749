// SPDX-License-Identifier: Apache-2.0
// dpde explain: the meaning of an error code, with a model that has the mistake.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <string>

#include "command.h"
#include "mistakes.h"
#include "source/error_codes.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

/// Marks the mistake with an arrow at the place where tests expect its code.
std::string marked(std::string text, std::string_view code) {
  const std::string marker = fmt::format("#~ {}", code), arrow = "# <-- here";
  for (std::size_t at = text.find(marker); at != std::string::npos; at = text.find(marker, at + arrow.size()))
    text.replace(at, marker.size(), arrow);
  return text;
}

}  // namespace

int explain(const std::string& code, const Streams& streams) {
  const auto* kind = std::ranges::find(diagnostic_kinds, code, &DiagnosticKind::code);
  if (kind == std::end(diagnostic_kinds)) {
    fmt::print(streams.err, "dpde: error[E0904]: there is no code {}\n  help: dpde explain E0301\n", code);
    return static_cast<int>(Exit::wrong_input);
  }
  std::string message(kind->message);
  for (std::size_t at = message.find("{}"); at != std::string::npos; at = message.find("{}", at))
    message.replace(at, 2, "...");
  fmt::print(streams.out, "{} {} ({})\n  {}\n", kind->code, kind->name,
             kind->severity == Severity::error ? "error" : "warning", message);
  const auto found = std::ranges::find(mistakes(), kind->name, &Mistake::kind);
  if (found != mistakes().end())
    fmt::print(streams.out, "\nFor example:\n\n{}", marked(std::string(found->text), kind->code));
  return flushed(static_cast<int>(Exit::done), streams);
}

void add_explain(CLI::App& app, Console& console) {
  const auto code = std::make_shared<std::string>();
  CLI::App* verb = app.add_subcommand("explain", "what an error code says, with a model that has the mistake");
  verb->add_option("code", *code, "as messages have it")->required()->type_name("CODE");
  verb->footer("Example:  dpde explain E0301");
  on_call(*verb, console, [code, &console] { return explain(*code, console.streams); });
}

}  // namespace dpde::tools
