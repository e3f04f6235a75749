// SPDX-License-Identifier: Apache-2.0
// dpde verify: certifies derivatives on the compiled kernels.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "analysis/certificate/certificate.h"
#include "analysis/certificate/run_check.h"
#include "analysis/certificate/solve_tolerance.h"
#include "command.h"
#include "driver/compile/switches.h"
#include "interrupt.h"
#include "preparing.h"
#include "report/certificate.h"
#include "scene_output.h"
#include "stability/stability_report.h"
#include "task_run.h"
#include "train.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

std::string target_of(const driver::Compiled& compiled, const driver::CompileOptions& options) {
  if (!compiled.problem) return options.selection.name.empty() ? "all programs" : "program " + options.selection.name;
  const model::Problem& problem = *compiled.problem;
  return problem.task->certifies ? "scene " + problem.scene : "task " + problem.task->name;
}

Json told(Job& job, const report::Report& report) {
  tell(job, report);
  return report.json;
}

/// Reasons for a failed certificate although no derivative is wrong.
std::string help_of(const std::optional<analysis::ToleranceEffect>& effect, double steady) {
  if (effect && effect->left > 0)
    return fmt::format(
        "solves were stopped early, as warn says, with up to {:.3g} of the right side left: allow more iterations, or "
        "leave warn out",
        effect->left);
  if (steady > 0)
    return fmt::format(
        "runs end where a state still changes by {:g} a unit of time, and derivatives are those of states at rest: a "
        "smaller tolerance may be enough (until steady {:g})",
        steady, steady * 1e-3);
  return "";
}

Json verify_one(Job& job) {
  Json result = Json::object();
  const std::optional<bool> learns = learns_from_trajectories(job);
  std::optional<driver::CompileOptions> options = learns ? job.compile_options() : std::nullopt;
  if (!options) return result;
  const Preparing preparing(job, "stopped before the certificate was complete");
  options->certify = options->tangent = options->adjoint = options->second = options->verify = true;
  options->takes_jumps = true;                // the certificate reports them
  options->selection.keeps_params = *learns;  // each run of the data may have its own
  std::optional<driver::Compiled> compiled = driver::compile(job.source(), *options, job.sink());
  if (!compiled) return result;
  analysis::CertifyOptions certify{thread_count(job.options()), job.options().seed, &interrupt_flag(),
                                   stability::judge_of_steps(job.options().force)};
  std::shared_ptr<driver::Compiled> single;
  if (compiled->is_single()) {
    single = std::make_shared<driver::Compiled>(std::move(*compiled));
    options->real = Precision::f64;
    compiled = driver::compile(job.source(), *options, job.sink());
    if (!compiled) return result;
  }
  auto shared = std::make_shared<driver::Compiled>(std::move(*compiled));
  const auto as_written = shared;
  if (analysis::has_loose_solves(*shared)) {
    DiagnosticSink silent;  // everything was reported before
    compiled = driver::compile(job.source(), analysis::with_solves_done(*shared), silent);
    if (compiled) shared = std::make_shared<driver::Compiled>(std::move(*compiled));
  }
  std::optional<analysis::Certificate> certificate = shared->problem
                                                         ? analysis::certify(job.source(), shared, certify, job.sink())
                                                         : analysis::certify_programs(*shared, certify);
  if (!certificate) return result;
  if (single && !analysis::certify_single_precision(job.source(), single, certify, *certificate, job.sink()))
    return result;
  if (interrupt_flag().load()) {
    job.sink().report("run-failed", {}, {"stopped before the certificate was complete"});
    return result;
  }
  const std::string target = target_of(*shared, *options);
  result = told(job, report::report_of_certificate(target, *certificate, *shared));
  driver::warn_of_jumps_left_out(*shared, job.sink());
  if (shared->problem && certificate->steady) warn_of_unrest(job, *shared->problem, *certificate->steady);
  certify.window = certificate->window.start;
  const std::optional<analysis::ToleranceEffect> effect =
      analysis::effect_of_tolerance(job.source(), as_written, certify);
  if (effect) result.update(told(job, report::report_of_tolerance(*effect, as_written != shared)));
  if (certificate->passed() && certificate->tests_nothing())
    job.sink().report("nothing-tested", {}, {target}, "let the task begin where its loss depends on its unknowns");
  if (!certificate->passed())
    job.sink().report("verification-failed", {}, {target, report::reason_of(*certificate)},
                      help_of(effect, shared->problem ? shared->problem->steady : 0));
  return result;
}

Json verify(Job& job) {
  if (!job.load_source()) return Json::object();
  return job.of_each_task([&] { return verify_one(job); });
}

}  // namespace

void add_verify(CLI::App& app, Console& console) {
  const auto options = std::make_shared<CommonOptions>();
  CLI::App* verb = app.add_subcommand("verify", "certify derivatives: tangent against adjoint, and Taylor slopes");
  add_common_options(*verb, *options, console, {.out = false, .force = true});
  verb->footer("Examples:\n  dpde verify burgers.dpde recover\n  dpde verify heat.dpde plate --set cells=33 --json");
  on_call(*verb, console, [options] { return call(*options, [&](Job& job) { return verify(job); }); });
}

}  // namespace dpde::tools
