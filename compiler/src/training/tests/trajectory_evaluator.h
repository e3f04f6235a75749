// SPDX-License-Identifier: Apache-2.0
// A simulation for one thread that runs from the first frames of trajectories, with fields to evaluate tests at the
// following frames.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "driver/scene/workspace.h"
#include "training/data/window_batches.h"
#include "training/tests/spectrum.h"

namespace dpde::training {

/// Values of unknowns, by name.
using UnknownValues = std::map<std::string, std::vector<double>>;
UnknownValues values_of(const std::vector<UnknownPart>& parts, const Eigen::VectorXd& x);

/// Number of frames in a test. Its steps are those of the task's scene; other scenes have frames at the same times.
int frames_of(const model::Test& test, const TrainingScene& scene, const files::Trajectories& on);
/// Whether the test evaluates all states, not only those with frames: true for numbers not compared with data.
bool looks_at_all(const model::Test& test, const files::Trajectories& on);
/// Steps between states that the test evaluates.
int looks_of(const model::Test& test, const files::Trajectories& on);
/// Time of the k-th evaluated state after the first.
double time_of_look(const model::Test& test, const TrainingScene& scene, const files::Trajectories& on, int k);

class TrajectoryEvaluator {
 public:
  /// Uses the `values` that the scene has: the task's own scene all, another one the weights of networks that it also
  /// calls.
  TrajectoryEvaluator(const TrainingScene& scene, const files::Trajectories& on, const UnknownValues& values,
                      const BatchOptions& options);

  /// The test's quantity at the frames after the first; infinite once the run has blown up. For a correlation: that
  /// with the data, 0 once it has blown up. For a spectrum: mean energies of its shells over these frames; infinite if
  /// it blows up.
  std::vector<double> roll(const model::Test& test, int run);
  /// Notes on the solves in the steps of all runs.
  std::deque<SolveNote> solve_notes() const { return simulation_->solve_notes(); }
  /// The same for the states of the data.
  std::vector<double> look_at_data(const model::Test& test, int run);
  /// Whether every state reaches the next frame except for rounding, i.e. this scene made the data.
  bool makes_data(int run);
  /// CPU seconds for a unit of time on one thread, over the steps of the test from the first frame of the first run,
  /// repeated until `at_least` seconds are measured. NaN if the run blows up.
  double cost(const model::Test& test, double at_least);

 private:
  const std::string& name_of(const model::Test& test) const {
    return scene_.compiled->names.tests.at(test.quantity.name);
  }
  int frames_of(const model::Test& test) const { return training::frames_of(test, scene_, on_); }
  void begin(int run);
  void take_values(int run);
  bool go_on(int steps);
  void look(const model::Test& test, int run, int frame, std::vector<double>& values);
  double number(const model::Test& test, int frame);
  Components fields(const model::Test& test, int frame);
  void take_data(int run, int frame);

  const TrainingScene& scene_;
  const files::Trajectories& on_;
  Workspace workspace_;
  std::optional<Simulation> simulation_;
  UnknownValues values_;
  Spectrum spectrum_;
};

}  // namespace dpde::training
