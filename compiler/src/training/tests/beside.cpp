// SPDX-License-Identifier: Apache-2.0
#include "training/tests/beside.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "training/data/mapped_data.h"

namespace dpde::training {

namespace {

/// Checks that the file has frames at the times of the test's own file, up to the end of the test.
bool has_frames(const model::Test& test, const model::Test::Baseline& beside, const TrainingScene& scene,
                const files::Trajectories& on, double own_step, DiagnosticSink& sink) {
  const double step = scene.compiled->problem->step, interval = on.every * step, end = test.when.count * own_step;
  const double frames = std::round(end / interval);
  if (std::abs(frames * interval - end) <= 1e-6 * interval && frames < on.frame_count()) return true;
  sink.report("bad-array-file", beside.origin.range,
              {on.path, fmt::format("its {} frames, {:.6g} apart, do not reach exactly {:.6g} after the first",
                                    on.frame_count(), interval, end)},
              fmt::format("{} steps of {:.6g} are wanted of {}", test.when.count, own_step, test.quantity.name));
  return false;
}

}  // namespace

driver::CompileOptions options_beside(const driver::Compiled& own, const std::string& scene) {
  driver::CompileOptions options;
  options.selection.name = own.options.selection.name;
  options.selection.beside = scene;
  options.selection.keeps_params = true;
  options.backend = own.options.backend;
  options.cache = own.options.cache;
  options.verify = own.options.verify;
  options.runs = driver::any_number_of_runs;
  DiagnosticSink silent;
  const std::optional<model::Problem> plain = model::from_ast(own.ast, options.selection, silent);
  std::set<std::string> known{"real", "networks"};
  for (std::size_t p = 0; plain && p < plain->params.size(); ++p) known.insert(plain->params[p].name);
  for (const auto& [key, value] : own.options.selection.overrides) {
    if (known.contains(key)) options.selection.overrides[key] = value;
  }
  return options;
}

std::string title_of(const model::Test::Baseline& beside) {
  std::string title = beside.scene;
  for (const auto& [key, value] : beside.method) {
    const std::string text = key == "step" ? fmt::format("{:.4g}", std::stod(value)) : value;
    title += fmt::format("{}{}={}", title == beside.scene ? " by " : " ", key, text);
  }
  return title;
}

std::unique_ptr<BesideScenes> BesideScenes::open(const TrainingScene& own, const std::vector<model::Test>& tests,
                                                 const SourceFile& source, DiagnosticSink& sink) {
  std::unique_ptr<BesideScenes> all(new BesideScenes(own));
  for (const model::Test& test : tests) {
    for (const model::Test::Baseline& beside : test.beside) {
      if (!all->add(test, beside, source, sink)) return nullptr;
    }
  }
  return all;
}

std::shared_ptr<const driver::Compiled> compile_beside(const driver::Compiled& own, const model::Test::Baseline& beside,
                                                       const SourceFile& source, DiagnosticSink& sink) {
  DiagnosticSink within;  // the same lines are valid in the task's own scene
  driver::CompileOptions options = options_beside(own, beside.scene);
  for (const auto& [key, value] : beside.method) options.selection.overrides[key] = value;
  std::optional<driver::Compiled> made = driver::compile(source, options, within);
  for (const Diagnostic& each : within.all()) {
    if (each.kind->severity == Severity::error)
      sink.report("bad-option", beside.origin.range,
                  {fmt::format("scene {}, beside a test: {}", beside.scene, each.message)}, each.hint);
  }
  return made ? std::make_shared<const driver::Compiled>(std::move(*made)) : nullptr;
}

void check_beside(const driver::Compiled& own, const SourceFile& source, DiagnosticSink& sink) {
  if (!own.problem || !own.problem->task) return;
  std::map<std::string, std::shared_ptr<const driver::Compiled>> scenes;
  std::set<std::pair<std::string, std::string>> seen;
  for (const std::vector<model::Test>& tests : {own.problem->task->tests, own.problem->task->growths}) {
    for (const model::Test& test : tests) {
      for (const model::Test::Baseline& beside : test.beside) {
        const auto [scene, is_new] = scenes.try_emplace(beside.scene);
        if (is_new) scene->second = compile_beside(own, beside, source, sink);
        if (scene->second && seen.emplace(beside.scene, beside.on).second)
          load_beside(own, *scene->second->problem, beside.on, source, beside.origin.range, sink);
      }
    }
  }
}

std::shared_ptr<const driver::Compiled> BesideScenes::compiled(const model::Test::Baseline& beside,
                                                               const SourceFile& source, DiagnosticSink& sink) {
  std::shared_ptr<const driver::Compiled>& there = compiled_[title_of(beside)];
  if (!there) there = compile_beside(*own_.compiled, beside, source, sink);
  return there;
}

std::optional<files::Trajectories> BesideScenes::loaded(const model::Test::Baseline& beside,
                                                        const model::Problem& scene, const SourceFile& source,
                                                        DiagnosticSink& sink) {
  const auto there = loaded_.find({beside.scene, beside.on});
  if (there != loaded_.end()) {
    if (std::optional<files::Trajectories> same = there->second.in_steps_of(scene.step)) return same;
  }
  std::optional<files::Trajectories> on =
      load_beside(*own_.compiled, scene, beside.on, source, beside.origin.range, sink);
  if (on) loaded_.insert_or_assign({beside.scene, beside.on}, *on);
  return on;
}

bool BesideScenes::add(const model::Test& test, const model::Test::Baseline& beside, const SourceFile& source,
                       DiagnosticSink& sink) {
  std::unique_ptr<TrainingScene>& there = scenes_[{title_of(beside), beside.on}];
  if (!there) {
    std::shared_ptr<const driver::Compiled> scene = compiled(beside, source, sink);
    if (!scene) return false;
    std::optional<files::Trajectories> on = loaded(beside, *scene->problem, source, sink);
    if (!on) return false;
    there = TrainingScene::open_on(source, std::move(scene), std::move(*on), beside.origin.range, sink);
    if (!there) return false;
    there->own_step = own_.own_step;
  }
  return has_frames(test, beside, *there, there->trajectories, own_.own_step, sink);
}

}  // namespace dpde::training
