// SPDX-License-Identifier: Apache-2.0
// One thread's simulation that runs from the first frames of trajectories, and fields beside it for what is asked at
// the frames behind them.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "driver/scene/workspace.h"
#include "training/data/window_batches.h"
#include "training/tests/spectrum.h"

namespace dpde::training {

/// Of unknowns, by their names.
using UnknownValues = std::map<std::string, std::vector<double>>;
UnknownValues values_of(const std::vector<UnknownPart>& parts, const Eigen::VectorXd& x);

/// Steps of a test are those of the task's scene; other scenes have frames at the same times.
int frames_of(const model::Test& test, const TrainingScene& scene, const files::Trajectories& on);
/// Whether all states are looked at, not those alone that have frames: of a number that is compared with none.
bool looks_at_all(const model::Test& test, const files::Trajectories& on);
/// Steps from one state that the test looks at to the next.
int looks_of(const model::Test& test, const files::Trajectories& on);
/// Of the k-th state behind the first.
double time_of_look(const model::Test& test, const TrainingScene& scene, const files::Trajectories& on, int k);

class TrajectoryEvaluator {
 public:
  /// Of `values` a scene takes what it has: the task's own all, another one the weights of networks that it calls too.
  TrajectoryEvaluator(const TrainingScene& scene, const files::Trajectories& on, const UnknownValues& values,
                      const BatchOptions& options);

  /// The test's quantity at the frames behind the first, infinite from where the run has blown up; of a correlation
  /// that with the data, 0 from there. Of a spectrum the energies of its shells, in the mean over these frames;
  /// infinite where it blows up.
  std::vector<double> roll(const model::Test& test, int run);
  /// What the solves of the steps of all runs have met.
  std::deque<SolveNote> solve_notes() const { return simulation_->solve_notes(); }
  /// The same of the states of the data.
  std::vector<double> look_at_data(const model::Test& test, int run);
  /// Whether every state comes to the next frame but for rounding: it is this scene that made the data.
  bool makes_data(int run);
  /// Seconds that a processor works for a unit of time, on one thread, over the steps of the test from the first frame
  /// of the first run on, again and again until `at_least` seconds are measured. Not a number where the run blows up.
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
