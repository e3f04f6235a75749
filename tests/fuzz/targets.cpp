// SPDX-License-Identifier: Apache-2.0
#include "fuzz/targets.h"

#include "model/from_ast.h"
#include "model/verify_model.h"
#include "source/render.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/lower/from_model.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "syntax/parser.h"
#include "syntax/print/print_ast.h"

namespace dpde::testing {

namespace {

/// Whether all reports point into the text and can be shown.
std::string check_reports(const SourceFile& source, const DiagnosticSink& sink) {
  const int size = static_cast<int>(source.text().size());
  for (const Diagnostic& diagnostic : sink.all()) {
    const SourceRange range = diagnostic.range;
    const bool is_valid = !range.is_known() || (range.begin <= range.end && range.end <= size);
    if (!is_valid) return "a report with the range " + std::to_string(range.begin) + " .. " + std::to_string(range.end);
    if (diagnostic.message.empty() || render_text(source, diagnostic).empty()) return "a report without a text";
  }
  return diagnostics_json(source, sink.all()).dump().empty() ? "reports without JSON" : "";
}

std::string first_of(const std::vector<std::string>& problems) { return problems.empty() ? "" : problems[0]; }

}  // namespace

std::string fuzz_parser(std::string_view text) {
  const SourceFile source("fuzz.dpde", std::string(text));
  DiagnosticSink sink;
  const std::string printed = ast::print(parse(source, sink));
  if (std::string problem = check_reports(source, sink); !problem.empty()) return problem;
  for (const Diagnostic& diagnostic : sink.all()) {
    if (!diagnostic.range.is_known()) return "a report of the parser that points nowhere";
  }
  if (sink.has_errors()) return "";
  DiagnosticSink again;
  const SourceFile second("fuzz.dpde", printed);
  const std::string twice = ast::print(parse(second, again));
  if (again.has_errors()) return "what was printed is not understood: " + render_text(second, again.all()[0]);
  return twice == printed ? "" : "prints first as\n" + printed + "\nthen as\n" + twice;
}

std::string fuzz_stencil_reader(std::string_view text) {
  const SourceFile source("fuzz.dpde", std::string(text));
  DiagnosticSink sink;
  const stencil::Module module = stencil::from_ast(parse(source, sink), sink);
  if (std::string problem = check_reports(source, sink); !problem.empty()) return problem;
  if (sink.has_errors()) return "";
  if (std::string problem = first_of(stencil::verify(module)); !problem.empty()) return problem;
  const std::string printed = stencil::print(module);
  DiagnosticSink again;
  const SourceFile second("fuzz.dpde", printed);
  const std::string twice = stencil::print(stencil::from_ast(parse(second, again), again));
  if (again.has_errors()) return "what was printed is not understood: " + render_text(second, again.all()[0]) + printed;
  return twice == printed ? "" : "prints first as\n" + printed + "\nthen as\n" + twice;
}

std::string fuzz_model(std::string_view text) {
  const SourceFile source("fuzz.dpde", std::string(text));
  DiagnosticSink syntax;
  const ast::File file = parse(source, syntax);
  if (syntax.has_errors()) return "";
  std::vector<std::string> names = model::scene_names(file);
  for (const std::string& task : model::task_names(file)) names.push_back(task);
  for (const std::string& name : names) {
    DiagnosticSink sink;
    const std::optional<model::Problem> problem = model::from_ast(file, {name, {}, "", false}, sink);
    if (problem && !sink.has_errors()) {
      if (std::string rule = first_of(model::verify(*problem)); !rule.empty()) return name + ": " + rule;
      const stencil::Module module = stencil::from_model(*problem, stencil::program_names(*problem), sink);
      const std::string rule = sink.has_errors() ? "" : first_of(stencil::verify(module));
      if (!rule.empty()) return name + ": " + rule;
    }
    if (std::string wrong = check_reports(source, sink); !wrong.empty()) return wrong;
    if (!problem && !sink.has_errors()) return name + ": nothing, and no report";
  }
  return "";
}

bool is_understood(std::string_view text) {
  DiagnosticSink sink;
  parse(SourceFile("fuzz.dpde", std::string(text)), sink);
  return !sink.has_errors();
}

}  // namespace dpde::testing
