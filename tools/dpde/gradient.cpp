// SPDX-License-Identifier: Apache-2.0
// dpde gradient: computes one loss and its gradient.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "gradient_file.h"
#include "interrupt.h"
#include "plot/scene_panels.h"
#include "report/gradient_growth.h"
#include "report/scene/solves.h"
#include "scene_output.h"
#include "support/maths/evaluate.h"
#include "support/names/number_text.h"
#include "task_run.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

/// Median seconds of `body`: of one call if it is slow, else of seven.
double median_seconds(const std::function<void()>& body) {
  std::vector<double> samples;
  double total = 0;
  while (samples.size() < 7 && (samples.empty() || total < 0.5)) {
    const auto start = std::chrono::steady_clock::now();
    body();
    samples.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    total += samples.back();
  }
  std::nth_element(samples.begin(), samples.begin() + std::ptrdiff_t(samples.size() / 2), samples.end());
  return samples[samples.size() / 2];
}

void report_unknown(Job& job, const TaskRun& run, const driver::Inverse::Part& part, const Eigen::VectorXd& gradient,
                    Json& json) {
  const std::string name = part.is_initial() ? "initial " + part.name : part.name;
  const double norm = norm_of(gradient, part);
  Json entry = {{"norm", json_number(norm)}};
  if (part.is_field()) {
    const std::vector<double> values = part.of(gradient);
    double largest = 0;
    for (const double value : values) largest = std::max(largest, std::abs(value));
    entry["max"] = json_number(largest);
    save_state(job, run.session->axes(), "gradient_" + part.name, values);
    if (!job.options().out.empty())
      save_picture(job, "gradient_" + part.name,
                   plot::panels_of_field(*run.session, part.name, "d loss / d " + name, "d loss / d " + name,
                                         {{part.name, values}}));
    if (part.size == 1) entry["value"] = json_number(values[0]);  // the norm would lose the sign
    job.say(part.size == 1
                ? fmt::format("d loss / d {} = {:.12g}\n", name, shown(values[0]))
                : fmt::format("d loss / d {}: norm {:.12g}, largest {:.12g}\n", name, shown(norm), shown(largest)));
  } else if (part.is_control()) {
    entry["values"] = json_numbers(part.of(gradient));
    job.say(fmt::format("d loss / d {}: norm {:.12g} over {} intervals\n", name, shown(norm), part.size));
  } else if (part.is_network()) {
    job.say(fmt::format("d loss / d {}: norm {:.12g} over {} weights\n", name, shown(norm), part.size));
  } else {
    entry["value"] = json_number(gradient[part.offset]);
    job.say(fmt::format("d loss / d {} = {:.12g}\n", name, shown(gradient[part.offset])));
  }
  if (norm == 0)
    job.say(fmt::format("  exactly 0: here the loss does not change with {}, and no test tells whether it should: {}\n",
                        name, analysis::causes_of_zero(*run.compiled)));
  json[part.name] = std::move(entry);
}

void report_steady(Job& job, TaskRun& run, double loss, const Eigen::VectorXd& gradient, Json& result) {
  const SteadyAdjoint adjoint = *run.inverse->last().steady;
  const Steady& state = adjoint.state;
  job.say(
      fmt::format("steady at t = {:.6g} (step {}); its adjoint after {} products with that of a step: {:.2g} of "
                  "the right side is left, at most {:.2g}\n",
                  state.t, state.step, adjoint.products, adjoint.residual, adjoint.bound));
  result["steady"] = {{"time", state.t},
                      {"steps", state.step},
                      {"change", json_number(state.change)},
                      {"products", adjoint.products},
                      {"residual", json_number(adjoint.residual)},
                      {"tolerance", adjoint.bound},
                      {"unrest", json_number(adjoint.unrest())},
                      {"loss_change", json_number(adjoint.unsteady)},
                      {"bytes", adjoint.bytes}};
  warn_of_unrest(job, run, run.inverse->start(), loss, {gradient});
}

/// Solves of the forward run and of the adjoints.
std::vector<driver::SolveReport> all_solves(const TaskRun& run) {
  const driver::Compiled& compiled = run.session->compiled();
  std::vector<driver::SolveReport> solves = driver::solves_of(compiled, run.session->rollout().solve_notes());
  for (driver::SolveReport& solve : driver::adjoint_solves_of(compiled, run.session->rollout().adjoint_solve_notes()))
    solves.push_back(std::move(solve));
  return solves;
}

/// Reports how equations were solved, and warns of the effect of a loose tolerance on the gradient.
void report_solves(Job& job, const TaskRun& run, const std::vector<driver::SolveReport>& solves, Json& result) {
  constexpr double loose = 1e-6;
  if (solves.empty()) return;
  result["solves"] = report::json_of(solves);
  job.say(driver::text_of(solves));
  driver::report_solves(run.session->problem(), solves, job.sink());
  const double tolerance = run.session->problem().scheme.solve.tolerance;
  const auto is_by_steps = [](const driver::SolveReport& solve) { return solve.note.most_iterations > 0; };
  double left = 0;
  for (const driver::SolveReport& solve : solves) {
    if (solve.note.missed > 0) left = std::max(left, solve.note.residual);
  }
  if (left > loose) {
    job.say(fmt::format(
        "solves that were stopped early, with up to {:.3g} of their right sides left, leave an error in the gradient: "
        "dpde verify measures it\n",
        left));
  } else if (tolerance > loose && std::ranges::any_of(solves, is_by_steps)) {
    job.say(fmt::format(
        "solves to {:.0e} of their right sides leave an error in the gradient: dpde verify measures it\n", tolerance));
  }
}

/// Warns if rounding has destroyed the gradient's digits.
Json growth_json(Job& job, const TaskRun& run, const std::vector<analysis::AdjointWatch::Look>& looks,
                 const Eigen::VectorXd& gradient) {
  const auto growth = report::gradient_growth(*run.session, *run.inverse, looks, run.inverse->start(), gradient);
  report::warn_of_growth(run.session->problem(), growth, job.sink());
  return report::json_of(growth);
}

Json gradient(Job& job, const TaskOptions& options) {
  Json result = Json::object();
  TaskRun run;
  if (!job.load_source() || !prepare_out(job) || !open_task(job, options, run)) return result;
  driver::Inverse& inverse = *run.inverse;
  Eigen::VectorXd gradient(inverse.size());
  std::optional<analysis::AdjointWatch> watch(std::in_place, *run.session, run.session->steps());
  const double loss = inverse.value_and_gradient(inverse.start(), gradient);
  const std::vector<analysis::AdjointWatch::Look> looks = watch->looks();
  watch.reset();
  const std::vector<driver::SolveReport> solves = all_solves(run);  // of this gradient, before further ones are timed
  if (interrupt_flag().load()) {
    job.sink().report("run-failed", {}, {"stopped before the gradient was complete"});
    return result;
  }
  if (!std::isfinite(loss) || !gradient.allFinite()) {
    const bool has_loss = std::isfinite(loss);
    const std::string grown = has_loss ? report::help_for_growth(*run.session, looks) : "";
    job.sink().report("loss-not-finite", run.task().losses.front().origin.range,
                      {has_loss ? "finite but its gradient is not" : fmt::format("{}", shown(loss)), "0"},
                      grown.empty() ? help_at_start(run, has_loss) : grown);
    result["loss"] = json_number(loss);
    return result;
  }
  Eigen::VectorXd again(inverse.size());
  say_certificate(job, run);
  const double wall = median_seconds([&] { inverse.value_and_gradient(inverse.start(), again); });
  const GradientResult last = inverse.last();
  const double primal = median_seconds([&] { inverse.value(inverse.start()); });
  warn_of_run(job, run, inverse.start());
  result["growth"] = growth_json(job, run, looks, gradient);
  job.say(fmt::format("{}: loss = {:.12g}\n", run.task().name, shown(loss)));
  Json parts = Json::object();
  for (const driver::Inverse::Part& part : inverse.parts()) report_unknown(job, run, part, gradient, parts);
  job.say(fmt::format(
      "loss and gradient in {}, {:.2f} times the loss alone; {} states stored ({}), {} steps computed again\n",
      human_seconds(wall), wall / primal, last.stored_states, human_bytes(double(last.checkpoint_bytes)),
      last.recomputed_steps));
  if (last.steady) report_steady(job, run, loss, gradient, result);
  report_solves(job, run, solves, result);
  result["loss"] = json_number(loss);
  result["gradient"] = std::move(parts);
  result["wall_s"] = wall;
  result["primal_wall_s"] = primal;
  result["ratio"] = json_number(wall / primal);
  result["checkpoints"] = {{"stored", last.stored_states},
                           {"recomputed_steps", last.recomputed_steps},
                           {"bytes", last.checkpoint_bytes},
                           {"block_steps", run.session->rollout().gradient_block_steps()},
                           {"tape_bytes", last.tape_bytes}};
  result["compile_s"] = run.compiled->seconds;
  result["certificate"] = certificate_json(run);
  std::vector<GradientField> fields;
  for (const driver::Inverse::Part& part : inverse.parts()) {
    if (part.is_field()) fields.push_back({part.name, part.of(gradient)});
  }
  save_gradient(job, *run.session, std::move(fields), result);
  result["files"] = job.files();
  return result;
}

}  // namespace

void add_gradient(CLI::App& app, Console& console) {
  const auto options = std::make_shared<TaskOptions>();
  CLI::App* verb = app.add_subcommand("gradient", "the loss of a task and its gradient");
  add_task_options(*verb, *options, console);
  verb->footer(
      "Examples:\n  dpde gradient burgers.dpde recover\n  dpde gradient heat.dpde find_kappa --memory 64M --json");
  on_call(*verb, console, [options] { return call(*options, [&](Job& job) { return gradient(job, *options); }); });
}

}  // namespace dpde::tools
