// SPDX-License-Identifier: Apache-2.0
// Scenes that the tests of a task name beside its own: compiled with the task's data and these tests, and with the
// files they begin from. Plain schemes that a network is measured by; or the scene with the network on another grid.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "training/data/window_batches.h"

namespace dpde::training {

/// "plain", "plain by advect=weno5".
std::string title_of(const model::Test::Baseline& beside);

class BesideScenes {
 public:
  /// null when `sink` has errors afterwards. Settings of --set that are values of parameters, or of precision, are for
  /// all scenes, others for the task's own alone.
  static std::unique_ptr<BesideScenes> open(const TrainingScene& own, const std::vector<model::Test>& tests,
                                            const SourceFile& source, DiagnosticSink& sink);

  const TrainingScene& scene(const model::Test::Baseline& beside) const {
    return *scenes_.at({title_of(beside), beside.on});
  }

  /// False after errors.
  bool add(const model::Test& test, const model::Test::Baseline& beside, const SourceFile& source,
           DiagnosticSink& sink);

 private:
  explicit BesideScenes(const TrainingScene& own) : own_(own) {}
  std::shared_ptr<const driver::Compiled> compiled(const model::Test::Baseline& beside, const SourceFile& source,
                                                   DiagnosticSink& sink);
  /// Methods of one scene share the frames of its file.
  std::optional<files::Trajectories> loaded(const model::Test::Baseline& beside, const model::Problem& scene,
                                            const SourceFile& source, DiagnosticSink& sink);

  const TrainingScene& own_;
  std::map<std::pair<std::string, std::string>, files::Trajectories> loaded_;  // by scene and file
  std::map<std::string, std::shared_ptr<const driver::Compiled>> compiled_;
  std::map<std::pair<std::string, std::string>, std::unique_ptr<TrainingScene>> scenes_;  // by title and file
};

/// Mistakes are reported where the test names the scene; null then.
std::shared_ptr<const driver::Compiled> compile_beside(const driver::Compiled& own, const model::Test::Baseline& beside,
                                                       const SourceFile& source, DiagnosticSink& sink);
/// Of a task: whether all scenes that its tests name compile, and the files they begin from fit their grids.
void check_beside(const driver::Compiled& own, const SourceFile& source, DiagnosticSink& sink);

/// The options to compile `scene` with in place of the task's own: without settings that it does not know or that are
/// not its to take.
driver::CompileOptions options_beside(const driver::Compiled& own, const std::string& scene);

}  // namespace dpde::training
