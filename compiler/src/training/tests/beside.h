// SPDX-License-Identifier: Apache-2.0
// Scenes with which the tests of a task compare its own: compiled with the task's data and these tests, and with their
// initial files. They are plain schemes as baseline for a network, or the scene with the network on another grid.
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
  /// Returns null if `sink` has errors afterwards. --set settings of parameters and precision apply to all scenes,
  /// others only to the task's own.
  static std::unique_ptr<BesideScenes> open(const TrainingScene& own, const std::vector<model::Test>& tests,
                                            const SourceFile& source, DiagnosticSink& sink);

  const TrainingScene& scene(const model::Test::Baseline& beside) const {
    return *scenes_.at({title_of(beside), beside.on});
  }

  /// Returns false after errors.
  bool add(const model::Test& test, const model::Test::Baseline& beside, const SourceFile& source,
           DiagnosticSink& sink);

 private:
  explicit BesideScenes(const TrainingScene& own) : own_(own) {}
  std::shared_ptr<const driver::Compiled> compiled(const model::Test::Baseline& beside, const SourceFile& source,
                                                   DiagnosticSink& sink);
  /// Frames of the file; shared by all methods of one scene.
  std::optional<files::Trajectories> loaded(const model::Test::Baseline& beside, const model::Problem& scene,
                                            const SourceFile& source, DiagnosticSink& sink);

  const TrainingScene& own_;
  std::map<std::pair<std::string, std::string>, files::Trajectories> loaded_;  // by scene and file
  std::map<std::string, std::shared_ptr<const driver::Compiled>> compiled_;
  std::map<std::pair<std::string, std::string>, std::unique_ptr<TrainingScene>> scenes_;  // by title and file
};

/// Errors are reported where the test names the scene; then returns null.
std::shared_ptr<const driver::Compiled> compile_beside(const driver::Compiled& own, const model::Test::Baseline& beside,
                                                       const SourceFile& source, DiagnosticSink& sink);
/// Checks that all scenes named by the task's tests compile, and that their initial files fit their grids.
void check_beside(const driver::Compiled& own, const SourceFile& source, DiagnosticSink& sink);

/// Options to compile `scene` instead of the task's own: without settings that it does not know or that apply only to
/// the task's scene.
driver::CompileOptions options_beside(const driver::Compiled& own, const std::string& scene);

}  // namespace dpde::training
