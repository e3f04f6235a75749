// SPDX-License-Identifier: Apache-2.0
// The public C++ interface, on top of the driver: diagnostics become exceptions, and a session provides the values of
// files and data.
#include "dpde/dpde.h"

#include <algorithm>
#include <functional>
#include <optional>

#include "analysis/certificate/quick_certificate.h"
#include "driver/report/restart_file.h"
#include "driver/report/run_description.h"
#include "driver/report/solve_report.h"
#include "driver/scene/inverse.h"
#include "driver/scene/scene_table.h"
#include "driver/scene/session.h"
#include "files/files.h"
#include "files/imports.h"
#include "host/input_task.h"
#include "host/opened.h"
#include "host/run_pictures.h"
#include "host/told.h"
#include "stability/stability_report.h"
#include "support/assert.h"

namespace dpde {

namespace host {

namespace {

/// Adds the source position of a failed solve to an error.
std::function<void(Error&)> explaining(const SourceFile& source, std::shared_ptr<const driver::Compiled> compiled) {
  return [source, compiled = std::move(compiled)](Error& error) {
    const SourceRange place = driver::place_of_solve(*compiled, error.solve_for());
    DiagnosticSink sink;
    driver::report_error(error, sink, place);
    Told all = told(source, sink);
    error.explain(std::move(all.text), std::move(all.messages));
  };
}

driver::Backend backend_of(HostBackend backend) {
  switch (backend) {
    case HostBackend::jit: return driver::Backend::jit;
    case HostBackend::cpp: return driver::Backend::cpp;
    case HostBackend::interpreter: return driver::Backend::interpreter;
  }
  unreachable("back end of a host");
}

analysis::Certifying certifying(const HostOptions& options) {
  if (!options.certify) return analysis::Certifying::when_cheap;
  return *options.certify ? analysis::Certifying::always : analysis::Certifying::never;
}

/// Copies the values that the session has read or computed for fields without a formula.
bool copy_values(driver::Session& session, const SourceFile& source, const dpde_scene& scene, Simulation& simulation,
                 DiagnosticSink& sink) {
  const model::Problem& problem = session.problem();
  const auto starts_elsewhere = [&](const model::Coefficient& coefficient) {
    const model::Unknown* unknown = problem.find_unknown(coefficient);
    return unknown != nullptr && unknown->from.formula;
  };
  for (const model::Coefficient& coefficient : problem.coefficients) {
    if (!coefficient.value.formula && !starts_elsewhere(coefficient))
      simulation.set_field(coefficient.name, session.workspace().dense(coefficient.name));
  }
  for (const model::State& state : problem.states) {
    const int index = session.rollout().state_index(state.name);
    if (!state.initial.formula && index >= 0) simulation.set_initial(state.name, session.initial(index));
  }
  if (!problem.task) return true;
  for (const driver::DataStates& datum : session.data()) {
    if (session.compiled().options.seeded) break;  // the host sets the seeds
    const auto is_it = [&](const dpde_datum& wanted) { return datum.name == wanted.name; };
    const dpde_datum* const end = scene.data + scene.datum_count;
    const dpde_datum* const wanted = std::find_if(scene.data, end, is_it);
    if (wanted == end) continue;
    std::vector<double> values;
    for (const std::string& field : datum.fields) {
      const std::vector<double> state = session.workspace().dense(field);
      values.insert(values.end(), state.begin(), wanted->is_number != 0 ? state.begin() + 1 : state.end());
    }
    simulation.set_field(datum.name, values);
  }
  const std::unique_ptr<driver::Inverse> inverse = driver::Inverse::open(session, source, sink);
  if (!inverse) return false;
  for (const driver::Inverse::Part& part : inverse->parts()) {
    const auto unknown = std::find_if(
        problem.task->unknowns.begin(), problem.task->unknowns.end(),
        [&](const model::Unknown& u) { return u.kind == part.kind && part.is_field() && u.name == part.name; });
    if (unknown == problem.task->unknowns.end() || unknown->from.file.empty()) continue;
    const Values start(inverse->start().data() + part.offset, static_cast<std::size_t>(part.size));
    if (part.is_initial()) simulation.set_initial(part.name, start);
    if (!part.is_initial()) simulation.set_field(part.name, start);
  }
  return true;
}

const char* name_of(HostBackend backend) {
  switch (backend) {
    case HostBackend::jit: return "jit";
    case HostBackend::cpp: return "cpp";
    case HostBackend::interpreter: return "interpreter";
  }
  unreachable("back end of a host");
}

/// Description as for `dpde run` with the same settings.
std::shared_ptr<const RunDescription> description_of(driver::Session& session, const SourceFile& source,
                                                     const HostOptions& options) {
  driver::RunOrigin origin{.file = source.path(), .scheme = options.scheme, .backend = name_of(options.backend)};
  for (const auto& [key, value] : options.set) origin.set.push_back(key + "=" + value);
  std::vector<std::string> states;
  for (int s = 0; s < session.rollout().state_count(); ++s) states.push_back(session.rollout().state_name(s));
  RunDescription run = driver::describe_run(session.problem(), session.axes(), states, source, origin);
  run.draw = drawing(session.shared_compiled(), session.axes());
  const auto kept = std::make_shared<driver::RunIdentity>();  // contains all programs as text: computed on first use
  run.identity = [compiled = session.shared_compiled(), kept] {
    if (kept->empty()) *kept = driver::identity_of(*compiled);
    return *kept;
  };
  return std::make_shared<const RunDescription>(std::move(run));
}

/// Data of the input task, one for each state.
std::vector<std::string> seeds_of(const model::Problem& problem, const HostOptions& options) {
  std::vector<std::string> seeds;
  if (options.inputs.empty()) return seeds;
  for (const model::Datum& datum : problem.task->data) seeds.push_back(datum.name);
  return seeds;
}

}  // namespace

Opened open(const SourceFile& file, const HostOptions& options) {
  DiagnosticSink sink;
  SourceFile source = files::with_imports(file, sink);
  if (sink.has_errors()) fail(source, sink);
  const bool seeded = !options.inputs.empty();
  const std::string name = seeded ? append_input_task(source, options, sink) : options.name;
  if (sink.has_errors()) fail(source, sink);
  std::optional<driver::Compiled> compiled = driver::compile_for_hosts(
      source, {name, options.set, options.scheme}, backend_of(options.backend),
      {.second_order = options.second_order, .seeded = seeded, .takes_jumps = options.force}, sink);
  if (!compiled) fail(source, sink);
  const auto kept = std::make_shared<const driver::Compiled>(std::move(*compiled));
  analysis::certify_quickly(source, kept, certifying(options), sink);
  if (sink.has_errors()) fail(source, sink);
  const std::shared_ptr<const driver::SceneTable> table = driver::SceneTable::make(kept, source, {}, sink);
  if (!table) fail(source, sink);
  driver::SessionOptions session_options;
  session_options.threads = options.threads;
  session_options.checkpoint_bytes = options.checkpoint_bytes;
  session_options.slots = options.slots;
  session_options.stop = options.stop;
  session_options.judge = stability::judge_of_steps(options.force);
  const std::unique_ptr<driver::Session> session = driver::Session::open(source, kept, session_options, sink);
  if (!session || !session_options.judge(*session, sink)) fail(source, sink);
  Simulation simulation(table->scene(),
                        {.threads = options.threads,
                         .checkpoint_bytes = session->options().checkpoint_bytes,
                         .slots = options.slots,
                         .stop = options.stop,
                         .explain = explaining(source, kept)},
                        table);
  simulation.describe(description_of(*session, source, options));
  if (!copy_values(*session, source, table->scene(), simulation, sink)) fail(source, sink);
  Told warnings = told(source, sink);
  if (options.warnings != nullptr) *options.warnings = warnings.messages;
  return {std::move(simulation), seeds_of(*kept->problem, options), std::move(warnings.messages),
          std::move(warnings.text)};
}

SourceFile read(const std::string& path) {
  DiagnosticSink sink;
  const std::optional<std::string> text = files::read_file(path, {}, sink);
  if (!text) fail(SourceFile(path, ""), sink);
  return {path, *text};
}

}  // namespace host

Simulation compile_text(const std::string& text, const HostOptions& options, const std::string& path) {
  return host::open(SourceFile(path, text), options).simulation;
}

Simulation compile_file(const std::string& path, const HostOptions& options) {
  return host::open(host::read(path), options).simulation;
}

}  // namespace dpde
