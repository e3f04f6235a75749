// SPDX-License-Identifier: Apache-2.0
#include "train.h"

#include <fmt/format.h>
#include <utility>

#include <chrono>
#include <cmath>

#include "driver/files.h"
#include "interrupt.h"
#include "progress.h"
#include "run_checkpoint.h"
#include "support/evaluate.h"

namespace dpde::tools {

namespace {

constexpr double default_interval = 600;  // seconds between checkpoints

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// TASK.training in the folder of --out.
class TrainingCheckpoint {
 public:
  TrainingCheckpoint(Job& job, const driver::Trainer& trainer, CheckpointInterval interval)
      : job_(job), interval_(interval), path_(std::filesystem::path(job.options().out) / (trainer.scene().task().name + ".training")) {}

  /// False after a diagnostic.
  bool resume(driver::Trainer& trainer) {
    std::error_code error;
    if (!std::filesystem::exists(path_, error)) {
      std::fputs(fmt::format("dpde: there is no {} yet: the training starts at its beginning\n", path_.string()).c_str(), stderr);
      return true;
    }
    const std::optional<std::string> bytes = driver::read_file(path_, {}, job_.sink());
    if (!bytes || !trainer.restore(*bytes, path_.string(), job_.sink())) return false;
    job_.say(fmt::format("goes on after {} updates, in epoch {} of {}\n", trainer.state().updates.made, trainer.state().epoch + 1, trainer.epochs()));
    saved_ = trainer.state().updates.made;
    return true;
  }
  void look(const driver::Trainer& trainer) {
    if (job_.options().out.empty()) return;
    const bool update_is_due = interval_.steps > 0 && trainer.state().updates.made % interval_.steps == 0;
    if (update_is_due || (interval_.seconds > 0 && seconds_since(last_) >= interval_.seconds)) save(trainer);
  }
  void save(const driver::Trainer& trainer) {
    if (job_.options().out.empty() || saved_ == trainer.state().updates.made) return;
    last_ = Clock::now();
    DiagnosticSink again;  // one message is enough; a full disk may have room again later
    if (driver::write_file(path_, trainer.save(), has_failed_ ? again : job_.sink())) {
      saved_ = trainer.state().updates.made;
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

/// Epochs worth a line: the first ones, then about forty.
bool is_shown(int epoch, int epochs) { return epoch <= 5 || epoch == epochs || epoch % std::max(1, epochs / 40) == 0; }

std::string line_of(int number, const driver::Epoch& epoch) {
  std::string text = fmt::format("epoch {:>5}  loss {:<14.8g}", number, shown(epoch.loss));
  if (!std::isnan(epoch.validation)) text += fmt::format(" validation {:<14.8g}", shown(epoch.validation));
  return text + fmt::format(" rate {:<10.4g} {} steps\n", epoch.rate, epoch.unroll);
}

struct Outcome {
  driver::TrainingEnd end = driver::TrainingEnd::epochs;
  double seconds = 0;
};

Outcome run_training(Job& job, driver::Trainer& trainer, TrainingCheckpoint& checkpoint, bool quiet) {
  Progress progress(false, quiet);
  std::size_t told = trainer.state().epochs.size();
  const auto first = trainer.state().updates.made;
  const auto start = Clock::now();
  const auto watch = [&](const driver::Trainer& now) {
    const driver::TrainingState& state = now.state();
    for (; told < state.epochs.size(); ++told) {
      if (is_shown(static_cast<int>(told) + 1, now.epochs())) job.say(line_of(static_cast<int>(told) + 1, state.epochs[told]));
    }
    if (progress.active()) {
      progress.show(fmt::format("epoch {} of {}  update {} of {}  loss {:.6g}", std::min(state.epoch + 1, now.epochs()), now.epochs(), state.updates.made, now.updates(), state.losses.back()),
                    static_cast<int>(state.updates.made - first), static_cast<int>(now.updates() - first));
    }
    checkpoint.look(now);
    return !interrupt_flag().load();
  };
  const driver::TrainingEnd end = trainer.run(watch);
  const double seconds = seconds_since(start);
  checkpoint.save(trainer);
  return {end, seconds};
}

void report_end(Job& job, const driver::Trainer& trainer, driver::TrainingEnd end) {
  if (end == driver::TrainingEnd::stopped) {
    job.sink().report("optimiser-interrupted", {}, {fmt::format("{}", trainer.state().updates.made), fmt::format("{}", trainer.updates())},
                      "with --out, the same command with --resume goes on from here");
    return;
  }
  if (end != driver::TrainingEnd::not_finite) return;
  const driver::Divergence& where = *trainer.divergence();
  const double last = trainer.state().losses.empty() ? std::nan("") : trainer.state().losses.back();
  std::string hint = fmt::format("in epoch {}, from frame {} of run {}{}; ", where.epoch + 1, where.window.frame, where.window.run, where.why.empty() ? "" : ": " + where.why);
  if (!std::isnan(last)) hint += fmt::format("the loss before was {:.6g}; ", last);
  hint += trainer.state().best_epoch < 0 ? "no epoch was complete; " : fmt::format("the values of epoch {} are kept; ", trainer.state().best_epoch + 1);
  job.sink().report("loss-not-finite", {}, {"not finite", fmt::format("{}", where.update)}, hint + "a smaller rate, clip 1, or shorter windows at first, as in unroll (1, 2, 4), may help");
}

Json unknowns_json(Job& job, const driver::Trainer& trainer) {
  Json unknowns = Json::object();
  const Eigen::VectorXd &best = trainer.best(), &start = trainer.start();
  for (const driver::UnknownPart& part : trainer.parts()) {
    if (part.kind == DPDE_UNKNOWN_PARAM) {
      unknowns[part.name] = {{"value", json_number(best[part.offset])}, {"start", json_number(start[part.offset])}};
      job.say(fmt::format("{} = {:.12g}\n", part.name, shown(best[part.offset])));
    } else {
      const auto values = best.segment(part.offset, part.size);
      unknowns[part.name] = {{"norm", json_number(values.norm())}, {"change", json_number((values - start.segment(part.offset, part.size)).norm())}};
    }
  }
  return unknowns;
}

void report_training(Job& job, const driver::Trainer& trainer, const TaskRun& run, const Outcome& outcome, Json& json) {
  const driver::TrainingState& state = trainer.state();
  const bool validates = !trainer.validation().empty();
  if (state.best_epoch >= 0) {
    job.say(fmt::format("{}: {} {:.8g} after epoch {} of {}, {} updates in {} ({}); compiled in {}\n", trainer.scene().task().name, validates ? "validation loss" : "loss",
                        shown(state.best_loss), state.best_epoch + 1, trainer.epochs(), state.updates.made, human_seconds(outcome.seconds),
                        driver::describe(outcome.end), human_seconds(run.compiled->seconds)));
  }
  json["iterations"] = state.updates.made;
  json["loss"] = json_numbers(state.losses);
  Json epochs = Json::array();
  for (const driver::Epoch& epoch : state.epochs) {
    epochs.push_back({{"unroll", epoch.unroll}, {"loss", json_number(epoch.loss)}, {"validation", validates ? json_number(epoch.validation) : Json(nullptr)}, {"rate", json_number(epoch.rate)}, {"iterations", epoch.updates}});
  }
  json["epochs"] = std::move(epochs);
  json["best"] = state.best_epoch < 0 ? Json(nullptr) : Json{{"epoch", state.best_epoch + 1}, {"loss", json_number(state.best_loss)}};
  json["windows"] = trainer.windows(0);
  json["wall_s"] = outcome.seconds;
  json["compile_s"] = run.compiled->seconds;
  json["certificate"] = certificate_json(run);
  json["reason"] = driver::describe(outcome.end);
  json["unknowns"] = unknowns_json(job, trainer);
}

std::optional<CheckpointInterval> interval_of(Job& job, const OptimizeOptions& options) {
  if (options.checkpoint_every.empty()) return CheckpointInterval{0, default_interval};
  const std::optional<CheckpointInterval> interval = parse_interval(options.checkpoint_every);
  if (!interval) job.sink().report("bad-option", {}, {fmt::format("--checkpoint-every {} is neither a number of updates nor a time, as in 30s or 10min", options.checkpoint_every)});
  if (interval && options.out.empty()) job.sink().report("bad-option", {}, {"--checkpoint-every needs the --out DIR of the run"});
  return job.failed() ? std::nullopt : interval;
}

}  // namespace

bool learns_from_trajectories(Job& job) {
  std::optional<driver::CompileOptions> options = job.compile_options();
  if (!options) return false;
  options->backend.reset();
  DiagnosticSink silent;
  const std::optional<driver::Compiled> compiled = driver::compile(job.source(), *options, silent);
  return compiled && compiled->problem && compiled->problem->task && compiled->problem->task->training;
}

Json train(Job& job, const OptimizeOptions& options) {
  Json json = Json::object();
  TaskRun run;
  std::optional<driver::CompileOptions> compile_options = job.compile_options();
  const std::optional<std::int64_t> bytes = checkpoint_bytes(job, options);
  const std::optional<CheckpointInterval> interval = interval_of(job, options);
  if (!compile_options || !bytes || !interval) return json;
  compile_options->selection.keeps_params = true;  // each run of the data may have its own
  if (!compile_task(job, options, *compile_options, run)) return json;
  const std::unique_ptr<driver::TrainingScene> scene = driver::TrainingScene::open(job.source(), run.compiled, job.sink());
  if (!scene || !driver::check_tests(*scene, job.source(), job.sink())) return json;
  const driver::BatchOptions batch{thread_count(options), 0, *bytes, &interrupt_flag()};
  const std::unique_ptr<driver::Trainer> trainer = driver::Trainer::open(*scene, options.epochs, batch, job.sink());
  if (!trainer) return json;
  TrainingCheckpoint checkpoint(job, *trainer, *interval);
  if (options.resume && !checkpoint.resume(*trainer)) return json;
  json["resumed_iterations"] = trainer->state().updates.made;
  const Outcome outcome = run_training(job, *trainer, checkpoint, options.quiet || options.json);
  report_end(job, *trainer, outcome.end);
  report_training(job, *trainer, run, outcome, json);
  write_trained(job, *trainer);
  json["test"] = Json::object();
  if (!interrupt_flag().load()) {
    const auto found = driver::tests_on_trajectories(*scene, trainer->best(), job.source(), batch, job.sink());
    const auto start = driver::tests_on_trajectories(*scene, trainer->start(), job.source(), batch, job.sink());
    if (!interrupt_flag().load()) json["test"] = report_tests(job, found, start);
  }
  json["files"] = job.files();
  return json;
}

}  // namespace dpde::tools
