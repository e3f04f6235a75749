// SPDX-License-Identifier: Apache-2.0
// dpde optimize: runs the task's optimiser.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>

#include "dpde/runtime/bytes.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/unknown_scales.h"
#include "driver/memory/tuning.h"
#include "files/evaluation_log.h"
#include "interrupt.h"
#include "limit_watch.h"
#include "model/print/print_model.h"
#include "optimize_output.h"
#include "progress.h"
#include "report/gradient_growth.h"
#include "scene_output.h"
#include "stencil/text/print_stencil.h"
#include "support/maths/evaluate.h"
#include "support/names/number_text.h"
#include "train.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

std::vector<UnknownScale> scales_of(const driver::Inverse& inverse) {
  std::vector<UnknownScale> parts;
  for (const driver::Inverse::Part& part : inverse.parts()) parts.push_back({part.offset, part.size});
  return dpde::scales_of(inverse.start(), std::move(parts), inverse.bounds());
}

/// Hash of everything the sequence of evaluations depends on: programs, start, data, times, method.
std::uint64_t key_of(const TaskRun& run, const model::Optimiser& method) {
  const std::string text = print(run.compiled->stencil);
  std::uint64_t key = hash_bytes(text.data(), text.size());
  const auto add = [&](const auto& value) { key = hash_bytes(&value, sizeof value, key); };
  add(run.compiled->real());
  add(method.kind);
  add(method.rate);
  add(method.gauss_newton);
  if (method.kind == model::Optimiser::Kind::lbfgs) {
    for (const UnknownScale& scale : scales_of(*run.inverse)) add(scale.size);
  }
  const Eigen::VectorXd& start = run.inverse->start();
  const Bounds bounds = run.inverse->bounds();
  key = hash_bytes(start.data(), sizeof(double) * std::size_t(start.size()), key);
  for (const auto& [name, value] : run.session->workspace().params()) add(value);
  for (const Eigen::VectorXd* bound : {&bounds.low, &bounds.high}) {
    key = hash_bytes(bound->data(), sizeof(double) * std::size_t(bound->size()), key);
  }
  add(run.session->steps());
  add(run.session->problem().t_begin);
  for (const model::Loss& loss : run.session->problem().task->losses) {
    for (const int step : run.session->steps_of(loss.when)) add(step);
  }
  const auto add_values = [&](const std::vector<double>& values) {
    key = hash_bytes(values.data(), sizeof(double) * values.size(), key);
  };
  for (int s = 0; s < run.session->rollout().state_count(); ++s) add_values(run.session->initial(s));
  for (const model::Coefficient& c : run.session->problem().coefficients)
    add_values(run.session->workspace().dense(c.name));
  for (const auto& [network, weights] : run.session->workspace().weights()) add_values(weights.values);
  for (const driver::DataStates& datum : run.session->data()) {
    for (const std::string& field : datum.fields) {
      add_values(run.session->workspace().dense(field));
    }
  }
  return key;
}

Method method_of(const model::Optimiser& optimiser) {
  switch (optimiser.kind) {
    case model::Optimiser::Kind::gradient_descent: return {Method::Kind::gradient_descent, optimiser.rate};
    case model::Optimiser::Kind::adam: return {Method::Kind::adam, optimiser.rate};
    case model::Optimiser::Kind::lbfgs: break;
    case model::Optimiser::Kind::newton_cg: return {Method::Kind::newton_cg};
  }
  return {Method::Kind::lbfgs};
}

/// Whether v'*H*v is below 0 by more than rounding, which is impossible for a sum of squares.
bool is_downwards(const Eigen::VectorXd& v, const Eigen::VectorXd& product) {
  constexpr double rounding = 1e-9;
  return v.dot(product) < -rounding * v.norm() * product.norm();
}

ScaledResult minimise_with(Job& job, TaskRun& run, const model::Optimiser& optimiser, const Objective& objective,
                           const IterationObserver& observer) {
  const Method method = method_of(optimiser);
  const Curvature curvature = optimiser.gauss_newton ? Curvature::gauss_newton : Curvature::full;
  if (const std::string why = run.session->engine().why_no_products(curvature);
      method.kind == Method::Kind::newton_cg && !why.empty())
    throw Error(ErrorKind::run, why);
  bool is_told = false;
  const HessianProduct product = [&](const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result) {
    run.inverse->product(x, v, result, curvature);
    if (is_told || curvature == Curvature::full || !is_downwards(v, result)) return;
    is_told = true;
    job.sink().report("negative-weight", run.task().losses.front().origin.range, {},
                      "weights of squares are 0 or positive; newton_cg(hessian = full) takes the loss as it is");
  };
  return minimise_scaled(method, objective, product, run.inverse->start(), optimiser.iterations,
                         scales_of(*run.inverse), observer, run.inverse->bounds());
}

/// Iterations that are printed: the first ones, then about forty.
bool is_shown(int iteration, int iterations) {
  if (iteration <= 5 || iteration == iterations) return true;
  const int stride = std::max(5, iterations / 40 / 5 * 5);
  return iteration % stride == 0;
}

struct Outcome {
  OptimiseResult result;
  std::vector<double> scales;  // of unknowns, if the method uses them
  double seconds = 0;
  Eigen::VectorXd first_gradient;
  std::optional<analysis::GradientGrowth> growth;  // of the first gradient
  std::string grown;                               // the message if that is not finite
};

Outcome optimise(Job& job, const OptimizeOptions& options, TaskRun& run, const model::Optimiser& method,
                 files::EvaluationLog* log) {
  Progress progress(options.streams.err, false, options.quiet || options.json);
  Outcome outcome;
  // For the first gradient.
  std::optional<analysis::AdjointWatch> watch(std::in_place, *run.session, run.session->steps());
  const Objective objective = [&](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    double loss = 0;
    if (log != nullptr && log->next(loss, gradient)) return loss;
    loss = run.inverse->value_and_gradient(x, gradient);
    if (watch && !interrupt_flag().load()) {
      const std::vector<analysis::AdjointWatch::Look> looks = watch->looks();
      watch.reset();
      const bool is_finite = std::isfinite(loss) && gradient.allFinite();
      if (is_finite) say_certificate(job, run);
      outcome.first_gradient = gradient;
      if (is_finite) {
        outcome.growth = report::gradient_growth(*run.session, *run.inverse, looks, x, gradient);
        report::warn_of_growth(run.session->problem(), outcome.growth, job.sink());
      }
      if (!is_finite && std::isfinite(loss)) outcome.grown = report::help_for_growth(*run.session, looks);
    }
    if (log != nullptr && !interrupt_flag().load()) log->append(loss, gradient);
    return loss;
  };
  std::string lines;  // printed after the clock has stopped if the run is short, so that printing is not measured
  std::optional<LimitWatch> limit;
  if (!options.force) limit.emplace(job, run);
  const auto start = std::chrono::steady_clock::now();
  const IterationObserver observer = [&](const Iteration& iteration) {
    if (limit) limit->look(iteration.iteration, iteration.x);
    if (is_shown(iteration.iteration, method.iterations)) {
      lines += fmt::format("iteration {:>5}  loss {:<14.8g} gradient {:.4g}\n", iteration.iteration,
                           shown(iteration.loss), shown(iteration.gradient_norm));
    }
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > 0.2) {
      job.say(lines);
      lines.clear();
      progress.show(
          fmt::format("iteration {} of {}  loss {:.6g}", iteration.iteration, method.iterations, iteration.loss),
          iteration.iteration, method.iterations);
    }
    return !interrupt_flag().load();
  };
  ScaledResult done = minimise_with(job, run, method, objective, observer);
  outcome.result = std::move(done.result);
  outcome.scales = std::move(done.scales);
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (limit && !interrupt_flag().load()) limit->look(outcome.result.iterations, outcome.result.x, true);
  job.say(lines);
  return outcome;
}

/// Warns if the run ends too far from its steady state for the gradient.
void warn_of_end(Job& job, TaskRun& run, const Outcome& outcome) {
  Eigen::VectorXd gradient(outcome.result.x.size());
  const double loss = run.inverse->value_and_gradient(outcome.result.x, gradient);
  if (gradient.allFinite()) warn_of_unrest(job, run, outcome.result.x, loss, {gradient, outcome.first_gradient});
}

void report_stop(Job& job, const TaskRun& run, const Outcome& outcome, int iterations) {
  const OptimiseResult& result = outcome.result;
  const model::Task& task = run.task();
  if (interrupt_flag().load()) {
    job.sink().report("optimiser-interrupted", {},
                      {fmt::format("{}", result.iterations), fmt::format("{}", iterations)},
                      "with --out, the same command with --resume goes on from here");
  } else if (result.reason == StopReason::not_finite && run.inverse->misfit()) {
    auto [misfit, range] = *run.inverse->misfit();
    misfit.hint = misfit.is_empty ? "seek within bounds that leave 0 out: unknown a in 0.01 .. 1"
                                  : "seek within bounds: unknown a in 0 .. 1; or " + misfit.hint;
    model::report(misfit, fmt::format(" after {} iterations", result.iterations), range, job.sink());
  } else if (result.reason == StopReason::not_finite) {
    const double last = result.losses.empty() ? NAN : result.losses.back();
    job.sink().report(
        "loss-not-finite", task.losses.front().origin.range,
        {std::isfinite(last) ? "finite but its gradient is not" : fmt::format("{}", shown(last)),
         fmt::format("{}", result.iterations)},
        !outcome.grown.empty()   ? outcome.grown
        : result.iterations == 0 ? help_at_start(run, std::isfinite(last))
        : run.inverse->unsolved().empty()
            ? "a smaller rate or bounds may help, or lbfgs, which shortens its steps"
            : run.inverse->unsolved() + "; a smaller rate or bounds may help, or lbfgs, which shortens its steps");
  }
}

/// Prints "scales: D 1.2e-06, q 5e+04" if the method used scales; returns null or an object.
Json report_scales(Job& job, const TaskRun& run, const std::vector<double>& sizes) {
  if (sizes.empty()) return nullptr;
  Json scales = Json::object();
  std::string text;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const std::string& name = run.inverse->parts()[i].name;
    scales[name] = json_number(sizes[i]);
    text += fmt::format("{}{} {:.3g}", i == 0 ? "" : ", ", name, sizes[i]);
  }
  job.say(fmt::format("scales of the unknowns: {}\n", text));
  return scales;
}

Json unknowns_json(Job& job, const TaskRun& run, const OptimiseResult& result) {
  Json unknowns = Json::object();
  for (const driver::Inverse::Part& part : run.inverse->parts()) {
    if (part.is_field() || part.is_network()) {
      unknowns[part.name] = {{"norm", json_number(norm_of(result.x, part))}};
      if (part.size != 1 || !part.is_field()) continue;
      unknowns[part.name]["value"] = json_number(result.x[part.offset]);
      job.say(fmt::format("{}{} = {:.12g}\n", part.is_initial() ? "initial " : "", part.name,
                          shown(result.x[part.offset])));
    } else if (part.is_control()) {
      unknowns[part.name] = {{"norm", json_number(norm_of(result.x, part))},
                             {"values", json_numbers(part.of(result.x))}};
    } else {
      unknowns[part.name] = {{"value", json_number(result.x[part.offset])}};
      job.say(fmt::format("{} = {:.12g}\n", part.name, shown(result.x[part.offset])));
    }
  }
  return unknowns;
}

Json optimize(Job& job, const OptimizeOptions& options) {
  Json json = Json::object();
  TaskRun run;
  if (options.resume && options.out.empty()) {
    job.sink().report("bad-option", {}, {"--resume needs the --out DIR of the run that goes on"});
    return json;
  }
  if (!job.load_source() || !prepare_out(job)) return json;
  const std::optional<bool> learns = learns_from_trajectories(job);
  if (!learns) return json;
  if (!*learns && options.epochs > 0) {
    job.sink().report("bad-option", job.place(), {"--epochs is for tasks that learn from trajectories"},
                      "--iterations is for those that do not");
    return json;
  }
  if (*learns) return train(job, options);
  const int iterations = options.iterations > 0 ? options.iterations : model::Optimiser{}.iterations;
  if (!open_task(job, options, run, driver::runs_of_an_iteration * iterations)) return json;
  model::Optimiser method = run.task().optimiser.value_or(model::Optimiser{});
  if (options.iterations > 0) method.iterations = options.iterations;
  std::unique_ptr<files::EvaluationLog> log;
  if (!options.out.empty()) {
    const std::filesystem::path path = std::filesystem::path(options.out) / "optimiser.log";
    log = std::make_unique<files::EvaluationLog>(path, key_of(run, method), run.inverse->size(), options.resume,
                                                 job.sink());
    if (!log->is_open()) return json;
  }
  const std::int64_t recorded = log ? log->recorded() : 0;
  if (options.resume) job.say(fmt::format("{} evaluations were there already\n", recorded));
  const Outcome outcome = optimise(job, options, run, method, log.get());
  const OptimiseResult& result = outcome.result;
  report_stop(job, run, outcome, method.iterations);
  job.say(fmt::format("{}: loss {:.8g} after {} iterations in {} ({}); compiled in {}\n", run.task().name,
                      shown(result.loss), result.iterations, human_seconds(outcome.seconds), describe(result.reason),
                      human_seconds(run.compiled->seconds)));
  if (run.session->problem().steady > 0 && !interrupt_flag().load()) warn_of_end(job, run, outcome);
  json["iterations"] = result.iterations;
  json["loss"] = json_numbers(result.losses);
  json["wall_s"] = outcome.seconds;
  json["compile_s"] = run.compiled->seconds;
  json["certificate"] = certificate_json(run);
  json["evaluations"] = result.evaluations;
  json["hessian_products"] = result.hessian_products;
  json["resumed_evaluations"] = recorded;
  json["reason"] = describe(result.reason);
  json["growth"] = report::json_of(outcome.growth);
  json["scales"] = report_scales(job, run, outcome.scales);
  json["unknowns"] = unknowns_json(job, run, result);
  json["test"] = Json::object();
  if (!interrupt_flag().load()) {
    const std::string kept = fmt::format("dpde test {} {} --from {} runs them", options.file, job.name(), options.out);
    json["test"] = run_own_tests(job, run, result.x, options.out.empty() ? "" : kept).values;
  }
  write_optimised(job, run, result);
  json["files"] = job.files();
  return json;
}

}  // namespace

void add_optimize(CLI::App& app, Console& console) {
  const auto options = std::make_shared<OptimizeOptions>();
  CLI::App* verb = app.add_subcommand("optimize", "run the optimiser of a task: find its unknowns");
  add_task_options(*verb, *options, console);
  verb->add_option("--iterations", options->iterations, "in place of the task's")->check(positive());
  verb->add_option("--epochs", options->epochs, "in place of the task's, where it learns from trajectories")
      ->check(positive());
  verb->add_option("--checkpoint-every", options->checkpoint_every,
                   "of such a task: updates, or time as in 30s, 10min (else every 10 minutes)")
      ->type_name("INTERVAL");
  verb->add_flag("--beside-named-only", options->only_named,
                 "tests: no plain methods beside but those that the task names");
  verb->add_flag("--resume", options->resume, "go on with a run that was stopped (needs its --out)");
  verb->footer(
      "Examples:\n  dpde optimize burgers.dpde recover --out results\n"
      "  dpde optimize burgers.dpde recover --out results --iterations 500 --resume");
  on_call(*verb, console, [options] { return call(*options, [&](Job& job) { return optimize(job, *options); }); });
}

}  // namespace dpde::tools
