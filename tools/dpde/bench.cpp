// SPDX-License-Identifier: Apache-2.0
// dpde bench: speed of the compiled step and of its adjoint compared with a plain copy, in one process; for a task that
// learns, the time of an update by category.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <utility>

#include "command.h"
#include "driver/memory/cost.h"
#include "driver/memory/machine_speed.h"
#include "driver/scene/session.h"
#include "interrupt.h"
#include "preparing.h"
#include "support/names/number_text.h"
#include "train.h"
#include "training/trainer.h"
#include "training/window_controls.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct BenchOptions : CommonOptions {
  int repeats = 9;
  bool measure = false;
};

double median(std::vector<double> samples) {
  std::nth_element(samples.begin(), samples.begin() + std::ptrdiff_t(samples.size() / 2), samples.end());
  return samples[samples.size() / 2];
}

/// A program that is run repeatedly; states are swapped after each run as in a rollout.
class Stepper {
 public:
  Stepper(driver::Session& session, const dpde_program& program, int threads)
      : executor_(program, session.workspace().layout(), threads), workspace_(session.workspace()), program_(program) {
    for (int p = 0; p < program.param_count; ++p) {
      const auto value = workspace_.params().find(program.params[p]);
      const double other = std::string_view(program.params[p]) == "t" ? session.problem().t_begin : 0;
      executor_.set_param(p, value == workspace_.params().end() ? other : value->second);
    }
    executor_.update_uniforms();
    restart();
  }

  /// Starts from the present fields of the workspace.
  void restart() {
    for (int f = 0; f < program_.field_count; ++f) executor_.bind(f, workspace_.field(program_.fields[f]).base());
    executor_.prepare();
  }

  bool is_tuning() const { return executor_.is_tuning(); }

  void run(int steps) {
    for (int k = 0; k < steps; ++k) {
      executor_.run();
      for (int s = 0; s < program_.swap_count; ++s) {
        const dpde_swap& swap = program_.swaps[s];
        void* const state = executor_.bound(swap.state);
        executor_.bind(swap.state, executor_.bound(swap.next));
        executor_.bind(swap.next, state);
      }
    }
  }

 private:
  Executor executor_;
  Workspace& workspace_;
  const dpde_program& program_;
};

constexpr double longest_tuning = 60;  // seconds; sweeps that take longer are measured with their first choice

double seconds_of(const std::function<void()>& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Number of steps that take about 20 ms, at most the scene's (later ones may blow up). The first step is not counted:
/// it does setup that happens once in a run, such as the factors of solves.
int steps_per_sample(Stepper& stepper, int limit, const std::function<void()>& restart) {
  stepper.run(1);
  restart();
  const double once = std::max(seconds_of([&] { stepper.run(1); }), 1e-7);
  return std::clamp(int(0.02 / once), 1, std::max(limit, 1));
}

/// As in runs, sweeps over large fields first find their fastest variant; for at most `longest_tuning` seconds.
void tune(Stepper& stepper, int limit, const std::function<void()>& restart) {
  double seconds = 0;
  for (int step = 0; stepper.is_tuning() && seconds < longest_tuning && !interrupt_flag().load(); ++step) {
    if (step % std::max(limit, 1) == 0) restart();
    seconds += seconds_of([&] { stepper.run(1); });
  }
}

/// Median seconds of one run of the program; the initial fields are restored before each sample. Solvers are kept
/// between samples, as a run keeps them between steps.
double seconds_per_step(driver::Session& session, const dpde_program& program, const BenchOptions& options,
                        const std::function<void()>& reset) {
  reset();
  Stepper stepper(session, program, thread_count(options));
  const auto restart = [&] {
    reset();
    stepper.restart();
  };
  const int steps = steps_per_sample(stepper, session.steps(), restart);
  tune(stepper, session.steps(), restart);
  const auto sample = [&] {
    restart();
    return seconds_of([&] { stepper.run(steps); });
  };
  std::vector<double> samples;
  for (int r = 0; r < options.repeats && !interrupt_flag().load(); ++r) {
    // Short scenes are run several times, so that each sample is long enough for the resolution of the clock.
    const int rounds = std::max(1, int(2e-4 / std::max(1e-9, sample())));
    double total = 0;
    for (int round = 0; round < rounds; ++round) total += sample();
    samples.push_back(total / rounds / steps);
  }
  return samples.empty() ? 0 : median(samples);
}

/// Sets the initial fields of the step and of its adjoint.
std::function<void()> resetter(driver::Session& session) {
  return [&session] {
    Workspace& workspace = session.workspace();
    for (int s = 0; s < session.rollout().state_count(); ++s) {
      const std::string& name = session.rollout().state_name(s);
      workspace.field(name).copy_in(session.initial(s));
      const auto derived = session.compiled().derived.find(session.compiled().step_name());
      if (derived == session.compiled().derived.end() || !derived->second.adjoint) continue;
      const stencil::Program& step = *session.compiled().stencil.find_program(session.compiled().step_name());
      for (const stencil::Swap& swap : step.swaps) {
        if (const std::string* bar = derived->second.adjoint->field(swap.next)) workspace.field(*bar).fill(1.0);
      }
    }
  };
}

/// Measures the time of an update of a task that learns, by category.
void time_training(Job& job, const BenchOptions& options, const std::shared_ptr<const driver::Compiled>& compiled,
                   Json& result) {
  const auto scene = training::TrainingScene::open(job.source(), compiled, job.sink());
  training::BatchOptions batch{thread_count(options), 0, std::numeric_limits<std::int64_t>::max(), &interrupt_flag()};
  batch.is_timed = true;
  const auto trainer = scene ? training::Trainer::open(*scene, 0, batch, job.sink()) : nullptr;
  if (!trainer) return;
  const training::UpdateSeconds found = trainer->time_updates(options.repeats);
  if (interrupt_flag().load()) return;
  const GradientSeconds& of = found.batch.gradients;
  const auto share = [&](double seconds) { return 100 * seconds / found.all; };
  result["update"] = {{"windows", found.windows},
                      {"steps", scene->steps()},
                      {"thread_seconds", found.all},
                      {"solver_forward", of.steps.rest()},
                      {"solver_backward", of.adjoints.rest()},
                      {"networks_forward", of.steps.networks},
                      {"networks_backward", of.adjoints.networks},
                      {"losses", of.losses.all},
                      {"waiting", found.batch.waiting},
                      {"overhead", found.overhead()},
                      {"overhead_fraction", found.overhead() / found.all}};
  job.say(
      fmt::format("an update of {} windows, {} steps each, takes {} of the time of {} threads: solver {:.1f} % "
                  "(forward {:.1f}, back {:.1f}), networks {:.1f} % (forward {:.1f}, back {:.1f}), "
                  "overhead {:.1f} % (losses {:.1f}, threads that wait {:.1f}, all else {:.1f})\n",
                  found.windows, scene->steps(), human_seconds(found.all), thread_count(options), share(found.solver()),
                  share(of.steps.rest()), share(of.adjoints.rest()), share(found.networks()), share(of.steps.networks),
                  share(of.adjoints.networks), share(found.overhead()), share(of.losses.all),
                  share(found.batch.waiting), share(found.overhead() - of.losses.all - found.batch.waiting)));
}

/// Measures the speed of the step and of its adjoint.
void bench_step(Job& job, const BenchOptions& options, driver::Session& session, const driver::Compiled& compiled,
                codegen::CodeCache* cache, Json& result) {
  const std::string step = compiled.step_name();
  const driver::Cost cost = driver::cost_of(compiled.loop, step);
  const double cells = double(session.workspace().cell_count());
  const std::function<void()> reset = resetter(session);
  const double step_s = seconds_per_step(session, *compiled.program(step), options, reset);
  const dpde_program* adjoint = compiled.adjoint_of(step);
  const double adjoint_bytes =
      adjoint == nullptr ? 0 : driver::cost_of(compiled.loop, compiled.derived.at(step).adjoint->program).bytes;
  const double adjoint_s = adjoint == nullptr ? 0 : seconds_per_step(session, *adjoint, options, reset);
  const driver::MachineSpeed machine =
      driver::machine_speed(cache, cost.bytes * cells, thread_count(options), options.measure);
  const double copy_rate = machine.copy, roof = machine.points(cost.bytes, cost.flops);
  if (interrupt_flag().load()) {
    job.sink().report("run-failed", {}, {"stopped before the measurement was complete"});
    return;
  }
  const double rate = cells / step_s, bandwidth = rate * cost.bytes;
  result["scene"] = session.problem().scene;
  result["points_per_s"] = json_number(rate);
  result["bytes_per_point"] = cost.bytes;
  result["achieved_bytes_per_s"] = json_number(bandwidth);
  result["stream_bytes_per_s"] = json_number(copy_rate);
  result["roofline_fraction"] = json_number(rate / roof);
  result["peak_flops_per_s"] = machine.flops;
  result["roofline_points_per_s"] = json_number(roof);
  result["machine_measured"] = machine.date;
  result["machine_busy"] = machine.is_busy;
  result["step_s"] = step_s;
  result["adjoint_step_s"] = adjoint == nullptr ? Json(nullptr) : Json(adjoint_s);
  result["adjoint_ratio"] = adjoint == nullptr ? Json(nullptr) : json_number(adjoint_s / step_s);
  result["adjoint_byte_ratio"] = adjoint == nullptr ? Json(nullptr) : json_number(adjoint_bytes / cost.bytes);
  result["compile_s"] = compiled.seconds;
  result["threads"] = thread_count(options);
  job.say(
      fmt::format("{}: a step takes {}, {} points/s, {}/s of fields ({:.0f} % of a copy of about that size, {}/s)\n",
                  session.problem().scene, human_seconds(step_s), human_count(rate), human_bytes(bandwidth),
                  100 * bandwidth / copy_rate, human_bytes(copy_rate)));
  job.say(fmt::format("the machine, measured {}, allows {} points/s: {:.0f} % of that are reached\n", machine.date,
                      human_count(roof), 100 * rate / roof));
  if (machine.is_busy) job.say("the machine is busy: steps are slower than they could be\n");
  if (adjoint != nullptr) {
    job.say(fmt::format("its adjoint takes {}, {:.2f} times as long ({:.2f} times the bytes)\n",
                        human_seconds(adjoint_s), adjoint_s / step_s, adjoint_bytes / cost.bytes));
  }
  job.say(fmt::format("compiled in {}\n", human_seconds(compiled.seconds)));
}

Json bench(Job& job, const BenchOptions& options) {
  Json result = Json::object();
  if (!job.load_source()) return result;
  const std::optional<bool> learns = learns_from_trajectories(job);
  std::optional<driver::CompileOptions> compile_options = learns ? job.compile_options() : std::nullopt;
  if (!compile_options) return result;
  compile_options->adjoint = true;
  compile_options->runs = driver::any_number_of_runs;
  compile_options->takes_jumps = compile_options->trusts_signs = true;  // only the speed matters
  compile_options->selection.keeps_params = *learns;                    // as in its training
  const std::shared_ptr<codegen::CodeCache> cache =
      std::exchange(compile_options->cache, nullptr);  // compile_s is measured
  std::optional<Preparing> preparing(std::in_place, job);
  std::optional<driver::Compiled> compiled = driver::compile(job.source(), *compile_options, job.sink());
  if (!compiled) return result;
  if (!compiled->problem) {
    job.sink().report("nothing-to-do", {}, {"the file has no scene to measure"});
    return result;
  }
  const auto shared = std::make_shared<driver::Compiled>(std::move(*compiled));
  driver::SessionOptions session_options;
  session_options.threads = thread_count(options);
  session_options.stop = &interrupt_flag();
  session_options.slots = 1;  // the gradient itself is not needed here
  const auto session = driver::Session::open(job.source(), shared, session_options, job.sink());
  preparing.reset();
  if (!session) return result;
  bench_step(job, options, *session, *shared, cache.get(), result);
  const model::Problem& problem = *shared->problem;
  if (!job.failed() && problem.task && problem.task->training && !training::seeks_controls(problem))
    time_training(job, options, shared, result);
  return result;
}

}  // namespace

void add_bench(CLI::App& app, Console& console) {
  const auto options = std::make_shared<BenchOptions>();
  CLI::App* verb = app.add_subcommand("bench", "speed of the compiled step and of its adjoint");
  add_common_options(*verb, *options, console, {.out = false, .seed = false});
  verb->add_option("--repeats", options->repeats, "samples; the median counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb->add_flag("--measure", options->measure, "measure again what this machine can do; else once");
  verb->footer("Example:  dpde bench heat.dpde cube --threads 1 --json");
  on_call(*verb, console, [options] { return call(*options, [&](Job& job) { return bench(job, *options); }); });
}

}  // namespace dpde::tools
