// SPDX-License-Identifier: Apache-2.0
// What a reader has to know of a test on trajectories beside its figure: whether it asks for what was learnt from, how
// far its runs lie outside of that, and how good its data are.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "files/trajectories.h"

namespace dpde::training {

struct TestConditions {
  bool knows_training = false;  // the data that were learnt from are there
  bool is_training_file = false;
  std::vector<int> known_runs;  // of the test, whose first frame is one of a run of the training with its parameters
  /// A parameter of runs, or "rms of u": the root of the mean square of a state in the first frames.
  struct Outside {
    std::string what;
    double low = 0, high = 0;         // of all runs of the training; of a state of all its frames
    std::map<int, double> runs = {};  // of the test, that lie outside
  };
  std::vector<Outside> outside;
  std::map<std::string, files::Trajectories::OwnError> own_errors;  // of the data that the test reads, by variable
  int steps_of_windows = 0, steps = 0;                              // of the training's loss, and of the test
};

/// Of tests on `on`, but for their steps; the training is on `learnt`, null: that is not there.
TestConditions conditions_of(const files::Trajectories* learnt, const files::Trajectories& on);

}  // namespace dpde::training
