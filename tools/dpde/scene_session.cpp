// SPDX-License-Identifier: Apache-2.0
#include "scene_session.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>
#include <variant>

#include "interrupt.h"

namespace dpde::tools {

namespace {

/// Location for the message of a missing scene.
SourceRange last_program(const ast::File& file) {
  SourceRange range;
  for (const ast::Declaration& declaration : file.declarations) {
    if (const auto* program = std::get_if<ast::Program>(&declaration.kind)) range = program->name.range;
  }
  return range;
}

}  // namespace

std::unique_ptr<driver::Session> open_scene(Job& job, DiagnosticSink& sink,
                                            const std::map<std::string, std::string>& overrides) {
  std::optional<driver::CompileOptions> options = job.compile_options();
  if (!options) return nullptr;
  for (const auto& [key, value] : overrides) options->selection.overrides[key] = value;
  return open_scene(job, *std::move(options), sink);
}

std::unique_ptr<driver::Session> open_scene(Job& job, driver::CompileOptions options, DiagnosticSink& sink) {
  options.without_task = true;
  std::optional<driver::Compiled> compiled = driver::compile(job.source(), options, sink);
  if (!compiled) return nullptr;
  if (!compiled->problem) {
    sink.report("nothing-to-do", last_program(compiled->ast), {"the file has no scene to run"},
                "add: scene NAME : PROGRAM { ... }; emitted text says at its end why it has none, and then its model's "
                "file is the one to run");
    return nullptr;
  }
  driver::SessionOptions session;
  session.threads = thread_count(job.options());
  session.stop = &interrupt_flag();
  const auto code = std::make_shared<driver::Compiled>(std::move(*compiled));
  job.runs(code);
  return driver::Session::open(job.source(), code, session, sink);
}

bool has_finite_exact(driver::Session& session, DiagnosticSink& sink) {
  std::vector<void*> states;
  for (int s = 0; s < session.rollout().state_count(); ++s) states.push_back(session.rollout().initial(s).base());
  for (const driver::ErrorNorms& norms : session.errors(session.end_time(), states)) {
    if (std::isfinite(norms.scale)) continue;
    const model::State* state = session.problem().find_state(norms.field);
    sink.report("exact-not-finite", state == nullptr ? SourceRange{} : (*state->exact)->origin.range,
                {norms.field, fmt::format("{:.6g}", session.end_time())},
                "the formula divides by 0 then, or takes a root or log of a number that has none");
    return false;
  }
  return true;
}

}  // namespace dpde::tools
