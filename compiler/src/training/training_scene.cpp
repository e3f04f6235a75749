// SPDX-License-Identifier: Apache-2.0
// Prepares a training: the scene for hosts, trajectories, fields from files.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "files/array_file.h"
#include "files/weights.h"
#include "model/analyse/placement.h"
#include "model/print/print_model.h"
#include "training/data/window_batches.h"
#include "training/window_controls.h"

namespace dpde::training {

namespace {

/// Checks that the data have the history of a multistep scheme, which is needed to start in the middle of a run.
bool has_histories(const model::Problem& problem, const files::Trajectories& trajectories, SourceRange where,
                   DiagnosticSink& sink) {
  for (const model::State& state : problem.states) {
    if (state.history_of.empty() || state.is_guess ||
        std::ranges::find(trajectories.states, state.name) != trajectories.states.end())
      continue;
    sink.report(
        "bad-array-file", where,
        {trajectories.path, fmt::format("it has no {}, what the time scheme of scene {} remembers of the step before",
                                        state.name, problem.scene)},
        "a scheme with a single step, as rk2, needs no memory");
    return false;
  }
  return true;
}

/// Text of the scene without the values that samples set: parameters in the file, and initial states.
std::string text_without_values(model::Problem problem, const files::Trajectories& trajectories) {
  for (model::Parameter& param : problem.params) {
    if (std::ranges::find(trajectories.params, param.name) != trajectories.params.end()) param.value = 0;
  }
  std::string controls;
  for (const model::Control& control : problem.controls) {  // by value, since their formulas may contain a parameter
    if (!problem.find_param(control.name)->unknown) controls += fmt::format("{}\n", fmt::join(control.values, " "));
  }
  for (model::State& state : problem.states) {
    if (std::ranges::find(trajectories.states, state.name) != trajectories.states.end()) state.initial = {};
  }
  problem.task.reset();
  return print(problem) + controls;
}

/// Parameter values other than the scene's own: all, or an even selection from the smallest to the largest.
std::vector<double> values_to_try(const files::Trajectories& trajectories, std::size_t p, double own) {
  constexpr std::size_t most = 16;  // each costs reading the scene once
  std::set<double> distinct;
  for (const files::Trajectories::Run& run : trajectories.runs) distinct.insert(run.params[p]);
  distinct.erase(own);
  const std::vector<double> all(distinct.begin(), distinct.end());
  if (all.size() <= most) return all;
  std::vector<double> some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(all[i * (all.size() - 1) / (most - 1)]);
  return some;
}

bool is_same_scene(const driver::Compiled& compiled, const files::Trajectories& trajectories, const std::string& own,
                   const std::string& name, double value) {
  model::Selection selection = compiled.options.selection;
  selection.overrides[name] = fmt::format("{}", value);
  DiagnosticSink ignored;
  const std::optional<model::Problem> other = model::from_ast(compiled.ast, selection, ignored);
  return other && text_without_values(*other, trajectories) == own;
}

/// Reports a setting that the runs of the file override with their own values. For compared scenes it is reported once,
/// with the task's own.
void tell_settings_not_taken(const TrainingScene& scene, const files::Trajectories& trajectories, SourceRange where,
                             DiagnosticSink& sink) {
  const model::Selection& selection = scene.compiled->options.selection;
  if (!selection.beside.empty()) return;
  for (std::size_t p = 0; p < trajectories.params.size(); ++p) {
    const std::string& name = trajectories.params[p];
    const auto set = selection.overrides.find(name);
    if (set == selection.overrides.end()) continue;
    double low = trajectories.runs.front().params[p], high = low;
    for (const files::Trajectories::Run& run : trajectories.runs) {
      low = std::min(low, run.params[p]);
      high = std::max(high, run.params[p]);
    }
    sink.report("data-of-other-parameter", where,
                {trajectories.path, name, fmt::format("{:.6g} to {:.6g}, one a run", low, high),
                 scene.compiled->problem->scene, set->second},
                fmt::format("its runs are made with their own: leave --set {} out, or make the data with it", name));
  }
}

}  // namespace

/// Checks parameters that the compiler needs as numbers, as in a seed, an extent or another parameter: another value
/// gives another scene.
bool runs_are_of_this_scene(const TrainingScene& scene, const files::Trajectories& trajectories, SourceRange where,
                            DiagnosticSink& sink) {
  tell_settings_not_taken(scene, trajectories, where, sink);
  const driver::Compiled& compiled = *scene.compiled;
  const std::string own = text_without_values(*compiled.problem, trajectories);
  for (std::size_t p = 0; p < trajectories.params.size(); ++p) {
    const std::string& name = trajectories.params[p];
    const std::vector<double> values = values_to_try(
        trajectories, p, std::ranges::find(compiled.problem->params, name, &model::Parameter::name)->value);
    if (std::ranges::all_of(values,
                            [&](double value) { return is_same_scene(compiled, trajectories, own, name, value); }))
      continue;
    sink.report(
        "bad-array-file", where,
        {trajectories.path,
         fmt::format("its runs differ in {}, of which scene {} makes more than a value, as a seed, an extent, a "
                     "control or another parameter",
                     name, compiled.problem->scene)},
        "what differs from run to run must be able to change between two windows: let in place of a parameter or a "
        "control that is made of it does");
    return false;
  }
  return true;
}

std::unique_ptr<TrainingScene> TrainingScene::open(const SourceFile& source,
                                                   std::shared_ptr<const driver::Compiled> compiled,
                                                   DiagnosticSink& sink) {
  const model::Problem& problem = *compiled->problem;
  const model::Datum* datum = problem.task->datum_of_windows();
  std::optional<files::Trajectories> trajectories = files::load_learnt_trajectories(problem, source, sink);
  if (!trajectories) return nullptr;
  std::unique_ptr<TrainingScene> scene =
      open_on(source, std::move(compiled), std::move(*trajectories), datum->origin.range, sink);
  if (!scene) return nullptr;
  const bool by_frames = scene->trajectories.has_frames_of_data || seeks_controls(*scene->compiled->problem);
  const int steps = scene->steps(), every = by_frames ? scene->trajectories.every : 1;
  if (steps % every != 0) {
    sink.report(
        "bad-array-file", datum->origin.range,
        {scene->trajectories.path,
         fmt::format("its frames are {} steps apart, and {} steps of the loss are no multiple of that", every, steps)});
    return nullptr;
  }
  if (scene->starts(steps) < 1) {
    sink.report(
        "bad-array-file", datum->origin.range,
        {scene->trajectories.path, fmt::format("its {} frames, {} steps apart, are too few for windows of {} steps",
                                               scene->trajectories.frame_count(), every, steps)});
    return nullptr;
  }
  return scene;
}

std::unique_ptr<TrainingScene> TrainingScene::open_on(const SourceFile& source,
                                                      std::shared_ptr<const driver::Compiled> compiled,
                                                      files::Trajectories on, SourceRange where, DiagnosticSink& sink) {
  const model::Problem& problem = *compiled->problem;
  auto scene = std::make_unique<TrainingScene>();
  if (!has_histories(problem, on, where, sink)) return nullptr;
  scene->trajectories = std::move(on);
  scene->own_step = problem.step;
  const auto take = [&](auto& to, const std::string& name, const model::Placement& placement,
                        const model::Source& from) {
    if (from.formula || from.file.empty()) return;
    std::optional<std::vector<double>> values = files::load_array(
        from, problem.unit_of(name), source, model::axes_at(problem.axes, placement), problem.scheme.real, sink);
    if (values) to.emplace_back(name, std::move(*values));
  };
  for (const model::State& state : problem.states) {
    const bool is_there = std::ranges::find(scene->trajectories.states, state.name) != scene->trajectories.states.end();
    if (!is_there) take(scene->given_states, state.name, state.placement, state.initial);
  }
  for (const model::Coefficient& coefficient : problem.coefficients) {
    const model::Unknown* unknown = problem.find_unknown(coefficient);
    take(scene->given_fields, coefficient.name, coefficient.placement,
         unknown != nullptr ? unknown->from : coefficient.value);
  }
  if (sink.has_errors()) return nullptr;
  scene->given_hash = files::hash_of_files(problem, source);
  scene->compiled = compiled;
  if (!runs_are_of_this_scene(*scene, scene->trajectories, where, sink)) return nullptr;
  scene->table = driver::SceneTable::make(std::move(compiled), source, {.sets_all = true}, sink);
  return scene->table ? std::move(scene) : nullptr;
}

int TrainingScene::starts(int steps) const {
  const std::span data(table->scene().data, static_cast<std::size_t>(table->scene().datum_count));
  const bool has_frames = std::ranges::any_of(data, [&](const dpde_datum& datum) {
    return !trajectories.is_goal(
        trajectories.name_of(*std::ranges::find(task().data, datum.name, &model::Datum::name)));
  });
  return trajectories.frame_count() - (has_frames ? steps / trajectories.every : 0);
}

void TrainingScene::give(Simulation& simulation) const {
  for (const auto& [name, values] : given_states) simulation.set_initial(name, values);
  for (const auto& [name, values] : given_fields) simulation.set_field(name, values);
}

void TrainingScene::begin(Simulation& simulation, const files::Trajectories& from, const Window& window) const {
  simulation.begin_at(from.times[static_cast<std::size_t>(window.frame)]);
  const files::Trajectories::Run& run = from.runs[static_cast<std::size_t>(window.run)];
  for (std::size_t p = 0; p < from.params.size(); ++p) simulation.set(from.params[p], run.params[p]);
  for (const std::string& state : from.states)
    simulation.set_initial(state, from.frames(window.run, state, window.frame));
}

}  // namespace dpde::training
