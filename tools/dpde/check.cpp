// SPDX-License-Identifier: Apache-2.0
// dpde check: parses and type-checks, and estimates the costs of a scene before it runs.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "check_text.h"
#include "command.h"
#include "driver/compile/switches.h"
#include "driver/memory/cost.h"
#include "driver/scene/data.h"
#include "model/chart_from_ast.h"
#include "preparing.h"
#include "progress.h"
#include "report/scene/scene.h"
#include "scene_session.h"
#include "task_run.h"
#include "training/tests/beside.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct CheckOptions : TaskOptions {
  bool all = false, explain = false, waves = false, all_cells = false, measure = false;
};

stability::Look look_of(const CheckOptions& options) {
  return {options.all_cells, shown_in_line(options.streams.err, false, options.quiet || options.json)};
}

/// Opens the scene at its initial state; null on failure. Faults of files were reported before.
std::unique_ptr<driver::Session> open_checked(Job& job) {
  DiagnosticSink silent;
  std::unique_ptr<driver::Session> session = open_scene(job, silent);
  for (const Diagnostic& diagnostic : silent.all()) {
    const bool is_told = diagnostic.kind == KindRef("start-not-finite").kind ||
                         diagnostic.kind == KindRef("coefficient-not-finite").kind;
    if (is_told) job.sink().add(diagnostic);
  }
  if (session != nullptr) has_finite_exact(*session, job.sink());
  return session;
}

void check_scene(Job& job, const CheckOptions& options, const driver::Compiled& compiled, CheckText& text,
                 Json& result) {
  const std::optional<std::int64_t> bytes = compiled.problem->task ? checkpoint_bytes(job, options) : 0;
  if (!bytes) return;
  const report::SceneOptions wanted{
      {thread_count(options), *bytes, options.checkpoint_folder}, look_of(options), options.waves, options.measure};
  const report::Report report = report::scene_report({job.source(), compiled, open_checked(job)}, wanted, job.sink());
  result.update(report.json);
  text.tell(job, compiled.problem->scene, report);
}

void check_programs(Job& job, const driver::Compiled& compiled, Json& result) {
  Json programs = Json::object();
  for (const std::string& name : compiled.primal_programs) {
    const driver::Cost cost = driver::cost_of(compiled.loop, name);
    programs[name] = {{"bytes_per_point", cost.bytes}, {"flops_per_point", cost.flops}};
    job.say(fmt::format("program {}: {} bytes and {} flops a cell\n", name, cost.bytes, cost.flops));
  }
  result["programs"] = std::move(programs);
}

/// Mistakes of the scenes that a task's data are from, as a run of the task would report them. Their warnings are not
/// those of the task: what it uses they may not.
void check_scenes_of_data(Job& job, const driver::Compiled& compiled) {
  if (!compiled.problem || !compiled.problem->task) return;
  std::set<std::string> checked;
  for (const model::Datum& datum : compiled.problem->task->data) {
    if (datum.scene.empty() || !checked.insert(datum.scene).second) continue;
    driver::CompileOptions options = driver::options_of_maker(compiled, datum);
    options.backend.reset();
    DiagnosticSink found;
    driver::compile(job.source(), options, found);
    for (const Diagnostic& diagnostic : found.all()) {
      if (diagnostic.kind->severity == Severity::error) job.sink().add(diagnostic);
    }
  }
}

Json check_one(Job& job, const CheckOptions& options, CheckText& text) {
  Json result = Json::object();
  std::optional<driver::CompileOptions> compile_options = job.compile_options();
  if (!compile_options) return result;
  compile_options->backend.reset();
  compile_options->verify = true;
  compile_options->adjoint = true;
  compile_options->takes_jumps = true;  // reported with everything else
  const Preparing preparing(job, "stopped before the check was complete");
  const std::optional<driver::Compiled> compiled = driver::compile(job.source(), *compile_options, job.sink());
  if (!compiled) return result;
  if (compiled->problem) driver::check_files(*compiled->problem, job.source(), job.sink());
  check_scenes_of_data(job, *compiled);
  training::check_beside(*compiled, job.source(), job.sink());
  if (compiled->problem) {
    check_scene(job, options, *compiled, text, result);
  } else {
    check_programs(job, *compiled, result);
  }
  for (const std::string& chart : model::chart_names(compiled->ast))
    model::chart_from_ast(compiled->ast, chart, job.sink());
  driver::report_jumps_left_out(*compiled, job.sink());
  driver::warn_of_watched(*compiled, job.sink());
  return result;
}

/// What each code that was reported means, with an example.
void explain_codes(const DiagnosticSink& sink, const Streams& streams) {
  std::set<std::string_view> codes;
  for (const Diagnostic& diagnostic : sink.all()) codes.insert(diagnostic.kind->code);
  for (const std::string_view code : codes) {
    fmt::print(streams.out, "\n");
    explain(std::string(code), streams);
  }
}

int check(const CheckOptions& options) {
  Job job(options);
  if (!options.all) job.tell_kinds_once("--all");
  Json result = Json::object();
  CheckText text(options.all || options.waves);
  guarded(job, [&] {
    if (job.load_source()) result = job.of_each_task([&] { return check_one(job, options, text); });
  });
  if (!result.contains("diagnostics")) result["diagnostics"] = Json::array();
  const int status = job.finish(std::move(result));
  if (options.explain && !options.json && !options.quiet) explain_codes(job.sink(), options.streams);
  return status;
}

}  // namespace

void add_check(CLI::App& app, Console& console) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* verb = app.add_subcommand("check", "find mistakes; say what a scene costs before it runs");
  add_common_options(*verb, *options, console, {.out = false, .seed = false});
  add_storage_options(*verb, *options);
  verb->add_flag("--all", options->all, "print all that is known, and each warning");
  verb->add_flag("--explain", options->explain, "what each code means, with an example, after the rest");
  verb->add_flag("--waves", options->waves, "how a step damps and delays waves of 4, 8, 16 and 32 cells");
  verb->add_flag("--all-cells", options->all_cells,
                 "look at what products fold back on large grids, too: it may take minutes");
  verb->add_flag("--measure", options->measure, "measure again what this machine can do; else once");
  verb->footer(
      "Examples:\n  dpde check burgers.dpde\n  dpde check burgers.dpde --all\n  dpde check burgers.dpde recover "
      "--memory 64M\n  dpde check heat.dpde "
      "plate --set cells=1024 --json");
  on_call(*verb, console, [options] { return check(*options); });
}

}  // namespace dpde::tools
