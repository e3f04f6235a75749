// SPDX-License-Identifier: Apache-2.0
#include "train.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>

#include "driver/report/solve_report.h"
#include "files/files.h"
#include "find_controls.h"
#include "interrupt.h"
#include "preparing.h"
#include "progress.h"
#include "run_checkpoint.h"
#include "stability/stability_report.h"
#include "support/maths/evaluate.h"
#include "support/names/number_text.h"
#include "training/tests/plain_methods.h"

namespace dpde::tools {

namespace {

constexpr double default_interval = 600;  // seconds between checkpoints

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::string trial_text(const training::Trials& trials, std::size_t trial) {
  return trials.count() == 1 ? "" : fmt::format("trial {} of {}, ", trial + 1, trials.count());
}

/// Saves TASK.training in the folder of --out.
class TrainingCheckpoint {
 public:
  TrainingCheckpoint(Job& job, const training::Trials& trials, CheckpointInterval interval)
      : job_(job),
        interval_(interval),
        path_(std::filesystem::path(job.options().out) / (trials.present().scene().task().name + ".training")) {}

  /// Returns false after a diagnostic.
  bool resume(training::Trials& trials) {
    std::error_code error;
    if (!std::filesystem::exists(path_, error)) {
      job_.tell(fmt::format("there is no {} yet: the training starts at its beginning", path_.string()));
      return true;
    }
    const std::optional<std::string> bytes = files::read_file(path_, {}, job_.sink());
    if (!bytes || !trials.restore(*bytes, path_.string(), job_.sink())) return false;
    const training::TrainingState& state = trials.present().state();
    const int epochs = trials.present().epochs();
    const std::string where =
        state.epoch < epochs
            ? fmt::format("in {}epoch {} of {}", trial_text(trials, trials.running()), state.epoch + 1, epochs)
            : fmt::format("with all {} epochs {}made", epochs,
                          trials.count() == 1 ? "" : fmt::format("of trial {} ", trials.running() + 1));
    job_.say(fmt::format("goes on after {} updates, {}\n", trials.made(), where));
    saved_ = trials.made();
    return true;
  }
  void look(const training::Trials& trials) {
    if (job_.options().out.empty()) return;
    const bool update_is_due = interval_.steps > 0 && trials.made() % interval_.steps == 0;
    if (update_is_due || (interval_.seconds > 0 && seconds_since(last_) >= interval_.seconds)) save(trials);
  }
  void save(const training::Trials& trials) {
    if (job_.options().out.empty() || saved_ == trials.made()) return;
    last_ = Clock::now();
    DiagnosticSink again;  // one message is enough; a full disk may have space again later
    if (files::write_file(path_, trials.save(), has_failed_ ? again : job_.sink())) {
      saved_ = trials.made();
    } else if (!std::exchange(has_failed_, true)) {
      job_.say(fmt::format("cannot write {}; the training goes on and tries again\n", path_.string()));
    }
  }

 private:
  Job& job_;
  CheckpointInterval interval_;
  std::filesystem::path path_;
  std::int64_t saved_ = 0;
  bool has_failed_ = false;
  Clock::time_point last_ = Clock::now();
};

/// Epochs that are printed: the first ones, then about forty.
bool is_shown_epoch(int epoch, int epochs) {
  return epoch <= 5 || epoch == epochs || epoch % std::max(1, epochs / 40) == 0;
}

std::string line_of(int number, const training::Epoch& epoch) {
  std::string text = fmt::format("epoch {:>5}  loss {:<14.8g}", number, shown(epoch.loss));
  if (!std::isnan(epoch.validation)) text += fmt::format(" validation {:<14.8g}", shown(epoch.validation));
  if (epoch.rate > 0) text += fmt::format(" rate {:<10.4g}", epoch.rate);
  return text + fmt::format(" {} steps\n", epoch.unroll);
}

/// Prints the epochs of a trial since the last call.
void tell_epochs(Job& job, const training::Trainer& trainer, std::size_t& told) {
  const training::TrainingState& state = trainer.state();
  for (; told < state.epochs.size(); ++told) {
    if (is_shown_epoch(static_cast<int>(told) + 1, trainer.epochs()))
      job.say(line_of(static_cast<int>(told) + 1, state.epochs[told]));
    std::fflush(job.options().streams.out);  // so that the file of a long training can be watched
  }
}

/// Returns the seconds it took.
double run_training(Job& job, training::Trials& trials, TrainingCheckpoint& checkpoint, bool quiet) {
  Progress progress(job.options().streams.err, false, quiet);
  std::size_t told = trials.present().state().epochs.size(), running = trials.running();
  const auto first = trials.made();
  const auto say_trial = [&] {
    if (trials.count() > 1)
      job.say(fmt::format("trial {} of {}, seed {}\n", trials.running() + 1, trials.count(),
                          trials.seed_of(trials.running())));
  };
  say_trial();
  const auto start = Clock::now();
  const auto watch = [&](const training::Trials& now) {
    if (std::exchange(running, now.running()) != now.running()) {
      told = 0;
      say_trial();
    }
    const training::TrainingState& state = now.present().state();
    tell_epochs(job, now.present(), told);
    if (progress.active()) {
      const int epochs = now.present().epochs();
      progress.show(
          fmt::format("{}epoch {} of {}  update {} of {}  loss {:.6g}", trial_text(now, now.running()),
                      std::min(state.epoch + 1, epochs), epochs, now.made(), now.updates(), state.losses.back()),
          static_cast<int>(now.made() - first), static_cast<int>(now.updates() - first));
    }
    checkpoint.look(now);
    return !interrupt_flag().load();
  };
  trials.run(watch);
  const double seconds = seconds_since(start);
  checkpoint.save(trials);
  return seconds;
}

void report_stop(Job& job, const training::Trials& trials) {
  job.sink().report("optimiser-interrupted", {},
                    {fmt::format("{}", trials.made()), fmt::format("{}", trials.updates())},
                    "with --out, the same command with --resume goes on from here");
}

void report_divergence(Job& job, const driver::Compiled& compiled, const training::Trials& trials, std::size_t trial) {
  const training::Trainer& trainer = *trials.all()[trial].trainer;
  const training::Divergence& where = *trainer.divergence();
  const double last = trainer.state().losses.empty() ? std::nan("") : trainer.state().losses.back();
  const std::string place = fmt::format("in {}epoch {}, from frame {} of run {}", trial_text(trials, trial),
                                        where.epoch + 1, where.window.frame, where.window.run);
  if (where.why.jump) {
    const Unsolved& jump = *where.why.jump;
    const SourceRange range = driver::place_of_solve(compiled, jump.solve_for());
    const UnsolvedFacts& facts = jump.facts();
    const std::string what =
        fmt::format("{}, step {} of {} (t = {:.6g}): {}", place, facts.step, facts.steps, facts.t, facts.text);
    job.sink().report("branches-do-not-meet", range, {what}, jump.hint());
    return;
  }
  std::string hint = fmt::format("{}{}; ", place, where.why.states.empty() ? "" : ": " + where.why.states);
  if (!std::isnan(last)) hint += fmt::format("the loss before was {:.6g}; ", last);
  hint += trainer.state().best_epoch < 0
              ? "no epoch was complete; "
              : fmt::format("the values of epoch {} are kept; ", trainer.state().best_epoch + 1);
  job.sink().report("loss-not-finite", {}, {"not finite", fmt::format("{}", where.update)},
                    hint + "a smaller rate, clip 1, or shorter windows at first, as in unroll (1, 2, 4), may help");
}

void report_ends(Job& job, const driver::Compiled& compiled, const training::Trials& trials) {
  for (std::size_t k = 0; k < trials.all().size(); ++k) {
    const training::Trial& trial = trials.all()[k];
    if (trial.end == training::TrainingEnd::stopped) report_stop(job, trials);
    if (trial.end == training::TrainingEnd::not_finite) report_divergence(job, compiled, trials, k);
  }
}

Json unknowns_json(Job& job, const training::Trainer& trainer) {
  Json unknowns = Json::object();
  const Eigen::VectorXd &best = trainer.best(), &start = trainer.start();
  for (const training::UnknownPart& part : trainer.parts()) {
    if (part.kind == DPDE_UNKNOWN_PARAM) {
      unknowns[part.name] = {{"value", json_number(best[part.offset])}, {"start", json_number(start[part.offset])}};
      job.say(fmt::format("{} = {:.12g}\n", part.name, shown(best[part.offset])));
    } else {
      const auto values = best.segment(part.offset, part.size);
      unknowns[part.name] = {{"norm", json_number(values.stableNorm())},
                             {"change", json_number((values - start.segment(part.offset, part.size)).stableNorm())}};
    }
  }
  return unknowns;
}

Json epochs_json(const training::Trainer& trainer) {
  Json epochs = Json::array();
  for (const training::Epoch& epoch : trainer.state().epochs) {
    epochs.push_back({{"unroll", epoch.unroll},
                      {"loss", json_number(epoch.loss)},
                      {"validation", trainer.validation().empty() ? Json(nullptr) : json_number(epoch.validation)},
                      {"rate", json_number(epoch.rate)},
                      {"iterations", epoch.updates}});
  }
  return epochs;
}

/// The results of any trial.
Json trial_json(const training::Trial& trial) {
  const training::TrainingState& state = trial.trainer->state();
  Json json = {{"iterations", state.updates.made},
               {"loss", json_numbers(state.losses)},
               {"epochs", epochs_json(*trial.trainer)}};
  json["best"] = state.best_epoch < 0 ? Json(nullptr)
                                      : Json{{"epoch", state.best_epoch + 1}, {"loss", json_number(state.best_loss)}};
  json["wall_s"] = trial.seconds;
  json["reason"] = training::describe(trial.end);
  return json;
}

void say_end(Job& job, const training::Trial& trial, const std::string& name) {
  const training::TrainingState& state = trial.trainer->state();
  if (state.best_epoch < 0) return;
  job.say(fmt::format("{}: {} {:.8g} after epoch {} of {}, {} updates in {} ({})\n", name,
                      trial.trainer->validation().empty() ? "loss" : "validation loss", shown(state.best_loss),
                      state.best_epoch + 1, trial.trainer->epochs(), state.updates.made, human_seconds(trial.seconds),
                      training::describe(trial.end)));
}

/// Reports the best trial like a single one, then all of them.
void report_training(Job& job, const training::Trials& trials, const TaskRun& run, double seconds, Json& json) {
  const training::Trial& best = trials.all()[trials.best()];
  const std::string& name = best.trainer->scene().task().name;
  for (std::size_t k = 0; k < trials.all().size(); ++k)
    say_end(job, trials.all()[k], trials.count() == 1 ? name : fmt::format("{}, trial {}", name, k + 1));
  if (trials.count() > 1) job.say(fmt::format("trial {} is the best and the one that is written\n", trials.best() + 1));
  json.update(trial_json(best));
  json["windows"] = best.trainer->windows(0);
  json["wall_s"] = seconds;
  json["compile_s"] = run.compiled->seconds;
  json["certificate"] = certificate_json(run);
  json["unknowns"] = unknowns_json(job, *best.trainer);
  if (trials.count() == 1) return;
  json["best_trial"] = trials.best() + 1;
  json["trials"] = Json::array();
  for (std::size_t k = 0; k < trials.all().size(); ++k) {
    Json trial = {{"seed", trials.seed_of(k)}};
    trial.update(trial_json(trials.all()[k]));
    json["trials"].push_back(std::move(trial));
  }
}

std::optional<CheckpointInterval> interval_of(Job& job, const OptimizeOptions& options) {
  if (options.checkpoint_every.empty()) return CheckpointInterval{0, default_interval};
  const std::optional<CheckpointInterval> interval = parse_interval(options.checkpoint_every);
  if (!interval)
    job.sink().report(
        "bad-option", {},
        {fmt::format("--checkpoint-every {} is neither a number of updates nor a time, as in 30s or 10min",
                     options.checkpoint_every)});
  if (interval && options.out.empty())
    job.sink().report("bad-option", {}, {"--checkpoint-every needs the --out DIR of the run"});
  return job.failed() ? std::nullopt : interval;
}

/// Mean processor seconds of one training; NaN if a checkpoint lacks it.
double mean_cost(const training::Trials& trials) {
  double sum = 0;
  for (const training::Trial& trial : trials.all()) sum += trial.cpu_seconds;
  return sum / static_cast<double>(trials.all().size());
}

training::TestedValues tested_values(const training::Trials& trials, const training::TrainingScene& scene) {
  training::TestedValues values;
  values.best = trials.best();
  for (const training::Trial& trial : trials.all())
    values.trials.push_back(training::values_of(trial.trainer->parts(), trial.trainer->best()));
  const training::Trainer& best = *trials.all()[values.best].trainer;
  values.start = training::values_of(best.parts(), best.start());
  values.spent = {scene.trajectories.cost_s, mean_cost(trials), static_cast<int>(trials.all().size())};
  return values;
}

bool is_drawn(const model::Test& test) { return test.kind == model::Test::Kind::number && training::is_compared(test); }

/// A chart needs a test with plain scenes for comparison.
bool can_be_drawn(Job& job, const training::TrainingScene& scene) {
  const model::Task& task = scene.task();
  if (std::ranges::any_of(task.tests, is_drawn)) return true;
  job.sink().report("no-reference", task.optimiser->origin.range,
                    {scene.compiled->problem->scene, fmt::format("no test of task {} has a plain scene", task.name)},
                    "test error = ... on trajectories(\"FILE.nc\") for N steps beside SCENE");
  return false;
}

/// Advice if Ctrl-C stops the tests of a completed training.
std::string how_to_test(const Job& job, const OptimizeOptions& options) {
  if (options.out.empty()) return "with --out what was found is kept, and dpde test with --from runs its tests";
  if (options.chart) return "the same command goes on with the training that is done";
  return fmt::format("dpde test {} {} --from {} runs them", options.file, job.name(), options.out);
}

/// All tests of the task; for a chart those that can be drawn.
std::unique_ptr<training::TestScenes> open_tests(Job& job, const training::TrainingScene& scene, bool is_chart) {
  const model::Task& task = scene.task();
  std::vector<model::Test> tests = task.tests;
  if (is_chart) std::erase_if(tests, [](const model::Test& test) { return !is_drawn(test); });
  return training::TestScenes::open(scene, job.source(), std::move(tests),
                                    is_chart ? std::vector<model::Test>{} : task.growths, job.sink());
}

}  // namespace

bool is_step_stable(Job& job, const TaskOptions& options, const TaskRun& run) {
  if (!run.compiled->problem->networks.empty()) return true;
  const auto session = driver::Session::open(job.source(), run.compiled, {.slots = 1}, job.sink());
  return session && stability::check_step(*session, options.force, job.sink());
}

std::optional<bool> learns_from_trajectories(Job& job) {
  std::optional<driver::CompileOptions> options = job.compile_options();
  if (!options) return std::nullopt;
  options->backend.reset();
  DiagnosticSink told;  // warnings are reported when the source is compiled for use
  const Preparing preparing(job);
  const std::optional<driver::Compiled> compiled = driver::compile(job.source(), *options, told);
  for (std::size_t k = 0; !compiled && k < told.all().size(); ++k) job.sink().add(told.all()[k]);
  if (!compiled) return std::nullopt;
  return compiled->problem && compiled->problem->task && compiled->problem->task->training;
}

Json train(Job& job, const OptimizeOptions& options) {
  Json json = Json::object();
  TaskRun run;
  std::optional<driver::CompileOptions> compile_options = job.compile_options();
  const std::optional<std::int64_t> bytes = checkpoint_bytes(job, options);
  const std::optional<CheckpointInterval> interval = interval_of(job, options);
  if (!compile_options || !bytes || !interval) return json;
  compile_options->selection.keeps_params = true;  // each run of the data may have its own
  std::optional<Preparing> preparing(std::in_place, job, "stopped before the task was prepared");
  if (!compile_task(job, options, *compile_options, run)) return json;
  if (options.iterations > 0 && !training::seeks_controls(*run.compiled->problem)) {
    job.sink().report("bad-option", run.compiled->problem->task->optimiser->origin.range,
                      {"--iterations is for tasks that do not learn from trajectories"},
                      "--epochs is for those that do");
    return json;
  }
  const std::unique_ptr<training::TrainingScene> scene =
      training::TrainingScene::open(job.source(), run.compiled, job.sink());
  if (scene && !is_step_stable(job, options, run)) return json;
  if (!scene || (options.chart && !can_be_drawn(job, *scene))) return json;
  training::BatchOptions batch{thread_count(options), 0, *bytes, &interrupt_flag()};
  batch.seed = options.seed;
  const std::unique_ptr<training::TestScenes> scenes = open_tests(job, *scene, options.chart.has_value());
  if (!scenes) return json;
  const training::TestRun tests{*scenes, batch, options.only_named, options.chart};
  if (training::seeks_controls(*run.compiled->problem)) {
    preparing.reset();
    return find_controls(job, options, run, *scene, batch);
  }
  const std::unique_ptr<training::Trials> trials = training::Trials::open(*scene, options.epochs, batch, job.sink());
  preparing.reset();
  if (!trials) return json;
  say_certificate(job, run);
  TrainingCheckpoint checkpoint(job, *trials, *interval);
  if (options.resume && !checkpoint.resume(*trials)) return json;
  json["resumed_iterations"] = trials->made();
  const double seconds = run_training(job, *trials, checkpoint, options.quiet || options.json);
  report_ends(job, *run.compiled, *trials);
  report_training(job, *trials, run, seconds, json);
  write_trained(job, *trials);
  json["test"] = Json::object();
  const auto is_stopped = [](const training::Trial& trial) { return trial.end == training::TrainingEnd::stopped; };
  if (std::ranges::none_of(trials->all(), is_stopped))
    run_tests(job, tests, tested_values(*trials, *scene), how_to_test(job, options), json);
  json["files"] = job.files();
  return json;
}

}  // namespace dpde::tools
