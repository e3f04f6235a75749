// SPDX-License-Identifier: Apache-2.0
// One thread's simulation that runs from the first frames of trajectories, and fields beside it for what is asked at the frames
// behind them.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "driver/window_batches.h"
#include "driver/workspace.h"

namespace dpde::driver {

/// Of unknowns, by their names.
using UnknownValues = std::map<std::string, std::vector<double>>;
UnknownValues values_of(const std::vector<UnknownPart>& parts, const Eigen::VectorXd& x);

class Roller {
 public:
  /// Of `values` a scene takes what it has: the task's own all, another one the weights of networks that it calls too.
  Roller(const TrainingScene& scene, const Trajectories& on, const UnknownValues& values, const BatchOptions& options);

  /// The test's quantity at the frames behind the first, infinite from where the run has blown up.
  std::vector<double> roll(const model::Test& test, int run);
  /// The same of the states of the data.
  std::vector<double> look_at_data(const model::Test& test, int run);
  /// Seconds of one thread for a unit of time, over the steps of the test from the first frame of the first run on, again and again until
  /// `at_least` seconds are measured. Not a number where the run blows up.
  double cost(const model::Test& test, double at_least);

 private:
  const dpde_program& program_of(const model::Test& test) const;
  int frames_of(const model::Test& test) const;
  void begin(int run);
  void take_values(int run);
  bool go_on(int steps);
  double look(const model::Test& test, int run, int frame);

  const TrainingScene& scene_;
  const Trajectories& on_;
  Workspace workspace_;
  std::optional<Simulation> simulation_;
  UnknownValues values_;
};

}  // namespace dpde::driver
