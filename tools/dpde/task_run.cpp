// SPDX-License-Identifier: Apache-2.0
#include "task_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>

#include "analysis/run/instability.h"
#include "driver/compile/switches.h"
#include "driver/memory/memory_plan.h"
#include "driver/report/back_flow.h"
#include "driver/report/blow_up.h"
#include "driver/report/missed_constraints.h"
#include "interrupt.h"
#include "preparing.h"
#include "scene_output.h"
#include "stability/stability_report.h"
#include "support/maths/evaluate.h"
#include "support/names/number_text.h"

namespace dpde::tools {

void add_storage_options(CLI::App& verb, TaskOptions& options) {
  verb.add_option("--memory", options.memory,
                  "bytes for stored states, with K, M or G; the steps between are computed again")
      ->type_name("BYTES");
  verb.add_option("--checkpoints-in", options.checkpoint_folder,
                  "keep the stored states in a file in this folder, as many as fit --memory")
      ->type_name("DIR");
}

void add_task_options(CLI::App& verb, TaskOptions& options, const Console& console) {
  add_common_options(verb, options, console, {.force = true});
  add_storage_options(verb, options);
  const auto flag = [&](const char* name, analysis::Certifying how, const char* what) {
    return verb.add_flag_callback(
        name, [&options, how] { options.certifying = how; }, what);
  };
  CLI::Option* always = flag("--certify", analysis::Certifying::always,
                             "check tangent against adjoint on a few cells, whatever it costs");
  flag("--no-certify", analysis::Certifying::never,
       "no such check (else where it takes less than a tenth of the compilation)")
      ->excludes(always);
}

namespace {

/// Checks memory; in a training each window has its own gradient.
bool is_possible(Job& job, const TaskOptions& options, const driver::Compiled& compiled) {
  const std::optional<std::int64_t> bytes = checkpoint_bytes(job, options);
  return bytes && (compiled.problem->task->training ||
                   driver::gradient_fits(compiled, {thread_count(options), *bytes, options.checkpoint_folder},
                                         job.source(), job.sink()));
}

/// Adds a line for each choice whose jump the derivatives ignore, and for possible ones.
void add_jumps(const SourceFile& source, const driver::Compiled& compiled, std::vector<std::string>& lines) {
  std::set<std::string> seen;
  const auto add = [&](const Origin& origin, const char* text) {
    const LineColumn at = source.locate(origin.range.begin);
    std::string line = fmt::format(fmt::runtime(text), at.line, at.column);
    if (seen.insert(line).second) lines.push_back(std::move(line));
  };
  for (const model::Jump& jump : compiled.jumps_left_out)
    add(jump.origin, "what the jump at {}:{} adds, which the gradient lacks (W0609)");
  for (const Origin& origin : compiled.unwatched)
    add(origin, "whether what divides at {}:{} keeps its sign in the run (W0609)");
}

}  // namespace

bool compile_task(Job& job, const TaskOptions& options, const driver::CompileOptions& wanted, TaskRun& run) {
  std::optional<driver::CompileOptions> compile_options = wanted;
  compile_options->adjoint = true;
  std::optional<driver::Compiled> compiled = driver::compile(job.source(), *compile_options, job.sink());
  if (!compiled) return false;
  if (!compiled->problem || !compiled->problem->task) {
    job.sink().report("nothing-to-do", {}, {"there is no task to work on"},
                      "name a task of the file: task NAME : SCENE { ... }");
    return false;
  }
  run.compiled = std::make_shared<driver::Compiled>(std::move(*compiled));
  job.runs(run.compiled);
  if (!is_possible(job, options, *run.compiled)) return false;
  driver::warn_of_jumps_left_out(*run.compiled, job.sink());
  driver::warn_of_unwatched(*run.compiled, job.sink());
  run.certificate = analysis::certify_quickly(job.source(), run.compiled, options.certifying, job.sink());
  if (run.certificate) add_jumps(job.source(), *run.compiled, run.certificate->left_out);
  return !job.failed();
}

std::optional<std::int64_t> checkpoint_bytes(Job& job, const TaskOptions& options) {
  if (options.memory.empty()) return std::numeric_limits<std::int64_t>::max();
  const std::optional<std::uint64_t> bytes = parse_bytes(options.memory);
  if (bytes) return static_cast<std::int64_t>(*bytes);
  job.sink().report("bad-option", {}, {fmt::format("--memory {} is not a number of bytes, as in 64M", options.memory)});
  return std::nullopt;
}

bool open_task(Job& job, const TaskOptions& options, TaskRun& run, double runs) {
  driver::SessionOptions session;
  session.threads = thread_count(options);
  session.stop = &interrupt_flag();
  session.checkpoint_folder = options.checkpoint_folder;
  session.judge = stability::judge_of_steps(options.force);
  const std::optional<std::int64_t> bytes = checkpoint_bytes(job, options);
  if (!bytes) return false;
  session.checkpoint_bytes = *bytes;
  std::optional<driver::CompileOptions> compile_options = job.compile_options();
  if (compile_options) compile_options->runs = runs;
  const Preparing preparing(job, "stopped before the task was prepared");
  if (!compile_options || !compile_task(job, options, *compile_options, run)) return false;
  if (run.compiled->problem->task->training) {
    job.sink().report("nothing-to-do", {},
                      {fmt::format("task {} learns from trajectories: each of their windows has a gradient of its own",
                                   run.compiled->problem->task->name)},
                      "dpde optimize learns from them, dpde verify proves the derivative");
    return false;
  }
  run.session = driver::Session::open(job.source(), run.compiled, session, job.sink());
  if (run.session) run.inverse = driver::Inverse::open(*run.session, job.source(), job.sink());
  if (run.inverse == nullptr) return false;
  run.inverse->assign(run.inverse->start());  // the task may start from other values than the scene
  return stability::check_step(*run.session, options.force, job.sink()) && !job.failed();
}

Json certificate_json(const TaskRun& run) {
  if (!run.certificate) return nullptr;
  const analysis::RunCheck& whole = run.certificate->run;
  Json checked = nullptr;
  if (whole.directions > 0) {
    checked = {{"cells", whole.grid},
               {"steps", whole.steps},
               {"until_steady", whole.is_steady},
               {"window", whole.window.empty() ? Json(nullptr) : Json(whole.window)},
               {"directions", whole.directions},
               {"unknown", whole.unknown},
               {"quotient_error", json_number(whole.error)},
               {"rounding", json_number(whole.rounding)}};
  }
  const bool is_compared = !run.certificate->program.empty();
  return {{"dot_product", is_compared ? json_number(run.certificate->dot_product) : Json(nullptr)},
          {"run", checked},
          {"left_out", run.certificate->left_out},
          {"untested", whole.untested},
          {"from_cache", run.certificate->from_cache},
          {"wall_s", run.certificate->seconds}};
}

void say_certificate(Job& job, const TaskRun& run) {
  if (!run.certificate || job.failed()) return;
  const analysis::RunCheck& whole = run.certificate->run;
  std::vector<std::string> parts;
  if (!run.certificate->program.empty())
    parts.push_back(fmt::format("adjoints to {:.1e}", run.certificate->dot_product));
  if (whole.directions > 0) {
    const std::string of = whole.is_steady ? "the steady state" : fmt::format("{} steps", whole.steps);
    parts.push_back(fmt::format("the gradient of {} on {} cells{} to {:.1e} (rounding {:.1e})", of, whole.grid,
                                whole.window.empty() ? "" : " " + whole.window, whole.error, whole.rounding));
  }
  const char* const verdict = run.certificate->left_out.empty() ? "certified" : "certified in part";
  std::string text = parts.empty() ? "not certified" : fmt::format("{}: {}", verdict, fmt::join(parts, "; "));
  for (const std::string& one : run.certificate->left_out) text += "\n  not checked: " + one;
  job.say(text + "\n");
}

bool warn_of_unrest(Job& job, const model::Problem& problem, const SteadyAdjoint& adjoint) {
  constexpr double most_unrest = 1e-4;
  const double unrest = adjoint.unrest();
  if (unrest <= most_unrest) return false;
  job.sink().report(
      "not-at-rest", problem.time_origin.range, {fmt::format("{:.2g}", std::abs(adjoint.unsteady))},
      fmt::format("take a smaller tolerance: until steady {:.1g}", problem.steady * 0.01 * most_unrest / unrest));
  return true;
}

namespace {

/// The unknown whose gradient differs most between both states, if by more than a thousandth of itself and of `first`,
/// and by more than rounding of a loss of this scale.
const driver::Inverse::Part* most_moved(const TaskRun& run, const Eigen::VectorXd& x, const SteadyGradients& gradients,
                                        double loss_scale) {
  constexpr double least_share = 1e-3, rounding = 1e-9;
  const driver::Inverse::Part* most = nullptr;
  double most_share = least_share;
  for (const driver::Inverse::Part& part : run.inverse->parts()) {
    const double difference = norm_of(gradients.at_rest - gradients.own, part);
    const double size = std::max(norm_of(gradients.own, part), norm_of(gradients.first, part));
    const bool is_rounding = difference * norm_of(x, part) <= rounding * loss_scale;
    if (is_rounding || difference <= most_share * size) continue;
    most = &part;
    most_share = difference / size;
  }
  return most;
}

}  // namespace

void warn_of_unrest(Job& job, TaskRun& run, const Eigen::VectorXd& x, double loss, SteadyGradients gradients) {
  const std::optional<SteadyAdjoint> steady = run.inverse->last().steady;
  if (!steady) return;
  if (gradients.first.size() == 0) gradients.first = Eigen::VectorXd::Zero(x.size());
  gradients.at_rest.resize(x.size());
  const double loss_at_rest = run.inverse->value_and_gradient_at_rest(x, gradients.at_rest);
  if (interrupt_flag().load()) return;
  const model::Problem& problem = run.session->problem();
  if (!gradients.at_rest.allFinite()) {
    if (!warn_of_unrest(job, problem, *steady))
      job.say("  not compared with the state at rest: Newton's method finds none from here\n");
    return;
  }
  const driver::Inverse::Part* part = most_moved(run, x, gradients, steady->scale);
  if (part == nullptr) {
    warn_of_unrest(job, problem, *steady);
    return;
  }
  job.sink().report("gradient-not-at-rest", problem.time_origin.range,
                    {part->name, fmt::format("{:.2g}", norm_of(gradients.own, *part)),
                     fmt::format("{:.2g}", norm_of(gradients.at_rest - gradients.own, *part)),
                     fmt::format("{:.6g}", loss_at_rest), fmt::format("{:.6g}", loss)},
                    fmt::format("take a smaller tolerance: until steady {:.1g}; where no run ends then, the step is as "
                                "long as is just stable: take a shorter one",
                                problem.steady * 0.01));
}

void warn_of_run(Job& job, TaskRun& run, const Eigen::VectorXd& x) {
  constexpr int looks = 64;
  driver::Session& session = *run.session;
  run.inverse->assign(x);
  driver::BackFlowWatch back_flow(session);
  const auto look = [&](const Snapshot& snapshot) { back_flow.look(snapshot.t, snapshot.states); };
  const RunResult done = session.rollout().run({std::max(1, session.steps() / looks), look});
  if (done.stopped || done.blow_up) return;
  driver::report_instabilities(session, job.sink(), stability::advice_on_blow_up);
  back_flow.report(job.sink());
  const double end = session.time_of(done.steps_done);
  driver::report_missed_constraints(session, session.misses(end, session.rollout().final_states()), job.sink());
}

OwnTests run_own_tests(Job& job, TaskRun& run, const Eigen::VectorXd& x, const std::string& if_stopped) {
  OwnTests tests;
  bool is_finite = true;
  const auto start = std::chrono::steady_clock::now();
  for (const auto& [name, value] : run.inverse->tests(x)) {
    tests.values[name] = json_number(value);
    job.say(fmt::format("test {} = {:.10g}\n", name, shown(value)));
    is_finite = is_finite && std::isfinite(value);
  }
  tests.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (interrupt_flag().load() && !tests.values.empty()) {
    job.sink().report("run-failed", {}, {"stopped before all tests were run"}, if_stopped);
  } else if (!is_finite && !job.failed()) {
    job.sink().report("run-failed", job.place(), {"a test is not a finite number with these values"});
  } else {
    warn_of_run(job, run, x);
  }
  return tests;
}

/// In f32 squares overflow above 3e38.
bool is_beyond_single(driver::Session& session) {
  if (session.problem().scheme.real != Precision::f32) return false;
  const double most = std::sqrt(static_cast<double>(std::numeric_limits<float>::max()));
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    for (const double value : session.initial(s)) {
      if (std::abs(value) > most) return true;
    }
  }
  return false;
}

std::string help_at_start(const TaskRun& run, bool has_loss) {
  const std::string unstable = analysis::instability(*run.session);
  if (!unstable.empty())
    return fmt::format("{}: a smaller step than {} may help (--set step=...)", unstable, run.session->problem().step);
  if (is_beyond_single(*run.session))
    return fmt::format("{} leaves the range of f32: --set real=f64, or units in which fields are near 1",
                       has_loss ? "a derivative" : "a value");
  if (!has_loss)
    return "a formula has no value where the task begins, as log(u) at 0: begin elsewhere (unknown ... from ...)";
  return "a formula has no derivative where the task begins, as sqrt(u) at 0: begin elsewhere (unknown ... from ...), "
         "or write one that has";
}

double norm_of(const Eigen::VectorXd& x, const driver::Inverse::Part& part) {
  return x.segment(part.offset, part.size).stableNorm();
}  // squares of 1e-200 underflow

}  // namespace dpde::tools
