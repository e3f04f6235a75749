// SPDX-License-Identifier: Apache-2.0
// dpde test: runs the tests of a task with given values, without optimising.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>

#include "codegen/network_table.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/weights_file.h"
#include "files/data_set_cost.h"
#include "files/files.h"
#include "found_file.h"
#include "interrupt.h"
#include "preparing.h"
#include "scene_output.h"
#include "support/maths/evaluate.h"
#include "train.h"
#include "training/window_controls.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct TestOptions : TaskOptions {
  std::vector<std::string> weights;  // FILE or NETWORK=FILE
  std::string from;                  // the folder of an optimize --out
  bool only_named = false;           // see OptimizeOptions
};

using WeightsByNetwork = std::map<std::string, std::vector<double>>;

// ---- weights from files
// ------------------------------------------------------------------------------------------------

std::vector<std::string> learnt_networks(const model::Task& task) {
  std::vector<std::string> names;
  for (const model::Unknown& unknown : task.unknowns) {
    if (unknown.kind == model::Unknown::Kind::network) names.push_back(unknown.name);
  }
  return names;
}

/// Parses NETWORK=FILE; or FILE for the only network, or with a name given by optimize.
std::optional<std::pair<std::string, std::string>> weights_named(Job& job, const model::Task& task,
                                                                 const std::string& text) {
  const std::vector<std::string> networks = learnt_networks(task);
  std::error_code error;
  const std::size_t equals = std::filesystem::exists(text, error) ? std::string::npos : text.find('=');
  const bool is_named = equals != std::string::npos;
  const std::string file = is_named ? text.substr(equals + 1) : text;
  std::string name = is_named ? text.substr(0, equals) : std::filesystem::path(text).stem().string();
  if (!is_named && networks.size() == 1) name = networks[0];
  if (std::ranges::find(networks, name) != networks.end()) return std::pair(name, file);
  const std::string why = networks.empty() ? fmt::format("task {} learns no network", task.name)
                          : is_named       ? fmt::format("task {} learns no network {}", task.name, name)
                                           : fmt::format("of which network of task {} are they?", task.name);
  const std::string hint = fmt::format("write --weights NETWORK=FILE, of {}", fmt::join(networks, ", "));
  job.sink().report("bad-option", {}, {fmt::format("--weights {}: {}", text, why)}, networks.empty() ? "" : hint);
  return std::nullopt;
}

std::optional<std::vector<double>> load_network(Job& job, const network::Network& network, const std::string& file) {
  const std::optional<std::string> bytes = files::read_file(file, {}, job.sink());
  if (!bytes) return std::nullopt;
  const codegen::NetworkTable table(network);
  try {
    return weights_of(*table.get(), parse_weights(*bytes, file), file);
  } catch (const Error& error) {
    job.sink().report("bad-array-file", {}, {file, error.what()});
    return std::nullopt;
  }
}

/// By network; nullopt after a diagnostic.
std::optional<WeightsByNetwork> given_weights(Job& job, const TestOptions& options, const model::Problem& problem) {
  WeightsByNetwork values;
  for (const std::string& text : options.weights) {
    const auto named = weights_named(job, *problem.task, text);
    if (!named) return std::nullopt;
    const auto& [network, file] = *named;
    if (values.contains(network)) {
      job.sink().report("bad-option", {}, {fmt::format("--weights names two files of network {}", network)});
      return std::nullopt;
    }
    std::optional<std::vector<double>> weights = load_network(job, *problem.find_network(network), file);
    if (!weights) return std::nullopt;
    job.say(fmt::format("weights of {} from {}\n", network, file));
    values[network] = std::move(*weights);
  }
  return values;
}

/// Without any source, weights are the initial ones of a training: says so.
void tell_untrained(Job& job, const TestOptions& options, const model::Task& task, const WeightsByNetwork& given) {
  for (const model::Unknown& unknown : task.unknowns) {
    if (unknown.kind != model::Unknown::Kind::network || !options.from.empty() || given.contains(unknown.name))
      continue;
    const std::string& file = unknown.from.file;
    job.say(file.empty()
                ? fmt::format("warning: network {} is not trained: its weights are random, as where task {} "
                              "begins; --from DIR or --weights FILE take those of a training\n",
                              unknown.name, task.name)
                : fmt::format("weights of {} from {}, as where task {} begins\n", unknown.name, file, task.name));
  }
}

bool has_tests(Job& job, const model::Problem& problem, SourceRange where) {
  const model::Task& task = *problem.task;
  if (!task.tests.empty() || !task.growths.empty()) return true;
  const std::string hint = !task.training ? "write test error = linf(u - u_ref), or another number of the run"
                           : training::seeks_controls(problem)
                               ? "it seeks controls for each window of its file; a task that learns can have tests"
                               : "write test err = mean(abs(u - u_ref)) on trajectories(\"test.nc\") for 32 steps";
  job.sink().report("nothing-to-do", where, {fmt::format("task {} has no tests", task.name)}, hint);
  return false;
}

double seconds_of_tests_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// ---- of a task that learns from trajectories
// ---------------------------------------------------------------------------

/// Opened with the file that the task learns from, if it exists: it states its cost. Otherwise with the file of a test,
/// which suffices.
struct TestedScene {
  std::unique_ptr<training::TrainingScene> scene;  // null after a diagnostic
  bool knows_training = false;
};
TestedScene open_scene(Job& job, const std::shared_ptr<const driver::Compiled>& compiled) {
  const model::Problem& problem = *compiled->problem;
  const model::Task& task = *problem.task;
  const model::Datum* datum = task.datum_of_windows();
  const model::Test& test = task.tests.empty() ? task.growths.front() : task.tests.front();
  const std::string learnt = files::find_data_file(datum->file, job.source().path()).string();
  std::error_code error;
  const bool is_there = std::filesystem::exists(learnt, error);
  if (is_there)
    files::stored_cost(learnt, 0, datum->origin.range, job.sink());  // reports damage, whatever its data are
  if (job.failed()) return {};
  DiagnosticSink told;  // the file is not required: it may be missing, or of another grid than that of --set
  std::optional<files::Trajectories> on = files::load_learnt_trajectories(problem, job.source(), told);
  const bool knows_training = on.has_value();
  if (is_there && !on && told.has_errors())
    job.say(fmt::format("warning: what was learnt from is left out: {}\n", told.all().front().message));
  const SourceRange where = on ? datum->origin.range : test.on_origin.range;
  if (!on) {
    on = files::load_trajectories(problem, test.on, job.source(), where, job.sink());
    if (on) on->cost_s = std::nan("");
  }
  if (!on) return {};
  return {training::TrainingScene::open_on(job.source(), compiled, std::move(*on), where, job.sink()), knows_training};
}

/// The initial values of the task, with those of --set.
struct Beginning {
  std::vector<training::UnknownPart> parts;
  Eigen::VectorXd values;
};
Beginning beginning_of(const training::TrainingScene& scene) {
  Simulation simulation(scene.table->scene(), {}, scene.table);
  scene.give(simulation);
  const std::vector<double> values = simulation.unknown_values();
  return {training::parts_of(scene.table->scene(), simulation),
          Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()))};
}

/// Loads TASK.training: as many trials as the task has. False after a diagnostic.
bool take_found(Job& job, const std::string& folder, const training::TrainingScene& scene, const Beginning& begin,
                training::TestedValues& tested) {
  const std::string& task = scene.task().name;
  const std::string path = (std::filesystem::path(folder) / (task + ".training")).string();
  const std::optional<std::string> bytes = files::read_file(path, {}, job.sink());
  if (!bytes) return false;
  std::vector<training::FoundTrial> trials = training::found_trials(*bytes, path, job.sink());
  if (trials.empty()) return false;
  trials.resize(std::min(trials.size(), static_cast<std::size_t>(scene.training().trials)));
  const std::string wanted = training::names_and_sizes(begin.parts);
  double cost = 0;
  for (const training::FoundTrial& trial : trials) {
    if (trial.values.task != task || trial.values.unknowns != wanted) {
      job.sink().report("bad-array-file", {},
                        {path, fmt::format("it is of task {} with the unknowns {}, wanted are those of task {}, {}",
                                           trial.values.task, trial.values.unknowns, task, wanted)},
                        "dpde optimize with --out writes such a file");
      return false;
    }
    tested.trials.push_back(training::values_of(begin.parts, trial.values.best));
    cost += trial.cpu_seconds / static_cast<double>(trials.size());
  }
  const auto best =
      std::ranges::min_element(trials, {}, [](const training::FoundTrial& trial) { return trial.values.best_loss; });
  tested.best = static_cast<std::size_t>(best - trials.begin());
  tested.start = training::values_of(begin.parts, best->values.start);
  tested.spent.training_s = cost;
  tested.spent.trials = static_cast<int>(trials.size());
  job.say(fmt::format("values of {} from {}\n",
                      trials.size() == 1 ? "the training" : fmt::format("{} trials", trials.size()), path));
  return true;
}

/// False after a diagnostic. Settings and files of weights override the values found.
bool take_values(Job& job, const TestOptions& options, const training::TrainingScene& scene,
                 training::TestedValues& tested) {
  const model::Problem& problem = *scene.compiled->problem;
  const Beginning begin = beginning_of(scene);
  const training::UnknownValues own = training::values_of(begin.parts, begin.values);
  tested.start = own;
  tested.spent.data_s = scene.trajectories.cost_s;
  if (options.from.empty()) {
    tested.trials.push_back(own);
  } else if (!take_found(job, options.from, scene, begin, tested)) {
    return false;
  }
  const std::optional<WeightsByNetwork> weights = given_weights(job, options, problem);
  if (!weights) return false;
  tell_untrained(job, options, *problem.task, *weights);
  for (training::UnknownValues& trial : tested.trials) {
    for (const auto& [name, values] : *weights) trial[name] = values;
    for (const training::UnknownPart& part : begin.parts) {
      if (scene.compiled->options.selection.overrides.contains(part.name)) trial[part.name] = own.at(part.name);
    }
  }
  return true;
}

Json tested_unknowns_json(Job& job, const std::vector<model::Unknown>& unknowns, const training::UnknownValues& found) {
  Json json = Json::object();
  for (const model::Unknown& unknown : unknowns) {
    const std::vector<double>& values = found.at(unknown.name);
    if (unknown.kind == model::Unknown::Kind::parameter) {
      json[unknown.name] = {{"value", json_number(values[0])}};
      job.say(fmt::format("{} = {:.12g}\n", unknown.name, shown(values[0])));
    } else {
      const Eigen::Map<const Eigen::VectorXd> all(values.data(), std::ssize(values));
      json[unknown.name] = {{"norm", json_number(all.stableNorm())}};
    }
  }
  return json;
}

Json test_on_trajectories(Job& job, const TestOptions& options) {
  Json json = Json::object();
  std::optional<driver::CompileOptions> compile_options = job.compile_options();
  if (!compile_options) return json;
  compile_options->selection.keeps_params = true;  // each run of the data may have its own
  std::optional<Preparing> preparing(std::in_place, job, "stopped before the tests were prepared");
  std::optional<driver::Compiled> made = driver::compile(job.source(), *compile_options, job.sink());
  if (!made) return json;
  TaskRun run;
  run.compiled = std::make_shared<driver::Compiled>(std::move(*made));
  job.runs(run.compiled);
  if (!has_tests(job, *run.compiled->problem, job.place())) return json;
  const auto [scene, knows_training] = open_scene(job, run.compiled);
  if (!scene || !is_step_stable(job, options, run)) return json;
  const model::Task& task = scene->task();
  const std::unique_ptr<training::TestScenes> tests =
      training::TestScenes::open(*scene, job.source(), task.tests, task.growths, job.sink());
  training::TestedValues values;
  if (!tests || !take_values(job, options, *scene, values)) return json;
  preparing.reset();
  training::BatchOptions batch{.threads = thread_count(options), .stop = &interrupt_flag()};
  json["test"] = Json::object();
  json["unknowns"] = tested_unknowns_json(job, task.unknowns, values.trials[values.best]);
  if (values.trials.size() > 1) json["best_trial"] = values.best + 1;
  json["compile_s"] = run.compiled->seconds;
  const auto start = std::chrono::steady_clock::now();
  run_tests(job, {*tests, batch, options.only_named, {}, knows_training}, values, "", json);
  json["wall_s"] = seconds_of_tests_since(start);
  return json;
}

// ---- of any other task
// -------------------------------------------------------------------------------------------------

/// Initial values of the task, or those found by optimize, overridden by files of weights and settings; nullopt after a
/// diagnostic.
std::optional<Eigen::VectorXd> values_to_test(Job& job, const TestOptions& options, const TaskRun& run) {
  const model::Problem& problem = run.session->problem();
  const std::optional<Eigen::VectorXd> found =
      options.from.empty() ? run.inverse->start() : load_found(job, run, options.from);
  const std::optional<WeightsByNetwork> weights = found ? given_weights(job, options, problem) : std::nullopt;
  if (!weights) return std::nullopt;
  tell_untrained(job, options, *problem.task, *weights);
  Eigen::VectorXd x = *found;
  for (const driver::Inverse::Part& part : run.inverse->parts()) {
    if (part.is_network() && weights->contains(part.name))
      std::ranges::copy(weights->at(part.name), x.data() + part.offset);
    const bool is_set = run.compiled->options.selection.overrides.contains(part.name);
    if (part.kind == model::Unknown::Kind::parameter && is_set) x[part.offset] = run.inverse->start()[part.offset];
  }
  return x;
}

Json test_run(Job& job, const TestOptions& options) {
  Json json = Json::object();
  TaskRun run;
  if (!open_task(job, options, run) || !has_tests(job, run.session->problem(), job.place())) return json;
  const std::optional<Eigen::VectorXd> x = values_to_test(job, options, run);
  if (!x) return json;
  training::UnknownValues values;
  for (const driver::Inverse::Part& part : run.inverse->parts()) values[part.name] = part.of(*x);
  json["unknowns"] = tested_unknowns_json(job, run.task().unknowns, values);
  json["compile_s"] = run.compiled->seconds;
  OwnTests tests = run_own_tests(job, run, *x, "");
  json["test"] = std::move(tests.values);
  json["wall_s"] = tests.seconds;
  return json;
}

Json run_test_verb(Job& job, const TestOptions& options) {
  if (!job.load_source() || !prepare_out(job)) return Json::object();
  const std::optional<bool> learns = learns_from_trajectories(job);
  if (!learns) return Json::object();
  Json json = *learns ? test_on_trajectories(job, options) : test_run(job, options);
  json["files"] = job.files();
  return json;
}

}  // namespace

void add_test(CLI::App& app, Console& console) {
  const auto options = std::make_shared<TestOptions>();
  options->certifying = analysis::Certifying::never;
  CLI::App* verb = app.add_subcommand("test", "run the tests of a task with values that are there already");
  add_common_options(*verb, *options, console, {.seed = false, .force = true});
  add_storage_options(*verb, *options);
  verb->add_option("--weights", options->weights,
                   "of a network that the task learns, as optimize writes them (.safetensors) or .npz; may be repeated")
      ->type_name("[NETWORK=]FILE")
      ->allow_extra_args(false);
  verb->add_option("--from", options->from, "the folder that optimize --out wrote: all that it found")
      ->type_name("DIR");
  verb->add_flag("--beside-named-only", options->only_named, "no plain methods beside but those that the task names");
  verb->footer(
      "Without --weights and --from the tests are of the values that the task begins with; --set changes a parameter.\n"
      "Examples:\n  dpde test correct.dpde learn --from results --out tests\n"
      "  dpde test correct.dpde learn --weights results/corrector.safetensors --json\n"
      "  dpde test burgers.dpde recover --set nu=0.03");
  on_call(*verb, console, [options] { return call(*options, [&](Job& job) { return run_test_verb(job, *options); }); });
}

}  // namespace dpde::tools
