// SPDX-License-Identifier: Apache-2.0
#include "lsp/understood.h"

#include <algorithm>
#include <exception>

#include "driver/compile/declared.h"
#include "driver/compile/pipeline.h"
#include "files/imports.h"
#include "model/chart_from_ast.h"
#include "model/data_set_from_ast.h"
#include "model/from_ast.h"
#include "stencil/text/from_ast.h"
#include "syntax/parser.h"

namespace dpde::lsp {

namespace {

/// Also reported for files that others import, where it is not a mistake.
bool is_of_libraries(const Diagnostic& diagnostic) {
  return diagnostic.kind == find_kind("nothing-to-do") || diagnostic.kind == find_kind("no-scene");
}

class Reader {
 public:
  Reader(Understood& result, Depth depth, const std::function<bool()>& is_interrupted)
      : result_(result), depth_(depth), is_interrupted_(is_interrupted) {}

  void run() {
    DiagnosticSink sink;
    result_.source = files::with_imports(std::move(result_.source), sink);
    result_.file = ast::parse(result_.source, sink);
    add(sink, {});
    if (sink.has_errors()) return;
    ast::File own = result_.file;
    std::erase_if(own.declarations, [](const ast::Declaration& declaration) { return declaration.imported; });
    std::vector<std::string> scenes = model::scene_names(own);
    const std::vector<std::string> tasks = model::task_names(own);
    for (const std::string& scene : scenes) look_at(scene, false);
    for (const std::string& task : tasks) look_at(task, true);
    if (scenes.empty() && tasks.empty()) compile("", false);
    if (result_.has_errors()) return;
    for (const std::string& chart : model::chart_names(own))
      read([&](DiagnosticSink& of) { model::chart_from_ast(result_.file, chart, of); }, chart);
    for (const std::string& runs : model::data_set_names(own))
      read([&](DiagnosticSink& of) { model::data_set_from_ast(result_.file, runs, of); }, runs);
  }

 private:
  /// Adds each message once, even if found in several scenes; one without a location is placed at the name of `about`.
  void add(const DiagnosticSink& sink, const std::string& about) {
    for (Diagnostic diagnostic : sink.all()) {
      if (is_of_libraries(diagnostic)) continue;
      if (!diagnostic.range.is_known()) diagnostic.range = driver::place_of(result_.source, about, about);
      const bool is_known = std::ranges::any_of(result_.diagnostics, [&](const Diagnostic& other) {
        return other.kind == diagnostic.kind && other.message == diagnostic.message && other.range == diagnostic.range;
      });
      if (!is_known) result_.diagnostics.push_back(std::move(diagnostic));
    }
  }

  template <class F>
  void read(const F& f, const std::string& about) {
    DiagnosticSink sink;
    try {
      f(sink);
    } catch (const std::exception& error) {
      sink.report("machine-failed", {}, {error.what()});
    }
    add(sink, about);
  }

  void look_at(const std::string& name, bool is_task) {
    if (!result_.is_whole || (is_interrupted_ && is_interrupted_())) {
      result_.is_whole = false;
    } else if (depth_ == Depth::derivatives) {
      compile(name, is_task);
    } else {
      make_problem(name);
    }
  }

  void make_problem(const std::string& name) {
    ast::File file = result_.file;
    std::erase_if(file.declarations,
                  [](const ast::Declaration& d) { return std::holds_alternative<ast::Import>(d.kind); });
    const auto body = [&](DiagnosticSink& sink) {
      stencil::from_ast(file, sink);  // as in the driver: broken kernels first
      if (sink.has_errors()) return;
      std::optional<model::Problem> problem = model::from_ast(file, {.name = name}, sink);
      if (problem && !sink.has_errors()) result_.problems.emplace(name, *std::move(problem));
    };
    read(body, name);
  }

  /// Like `dpde check`, without machine code.
  void compile(const std::string& name, bool is_task) {
    driver::CompileOptions options;
    options.selection.name = name;
    options.adjoint = is_task;
    const auto body = [&](DiagnosticSink& sink) {
      std::optional<driver::Compiled> compiled = driver::compile(result_.source, options, sink);
      if (compiled && compiled->problem) result_.problems.emplace(name, *std::move(compiled->problem));
    };
    read(body, name);
  }

  Understood& result_;
  Depth depth_;
  const std::function<bool()>& is_interrupted_;
};

}  // namespace

bool Understood::has_errors() const {
  return std::ranges::any_of(diagnostics, [](const Diagnostic& d) { return d.kind->severity == Severity::error; });
}

Understood understand(const std::string& path, const std::string& text, Depth depth,
                      const std::function<bool()>& is_interrupted) {
  Understood result;
  result.source = SourceFile(path, text);
  Reader(result, depth, is_interrupted).run();
  return result;
}

}  // namespace dpde::lsp
