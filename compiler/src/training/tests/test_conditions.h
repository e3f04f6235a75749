// SPDX-License-Identifier: Apache-2.0
// Information needed to judge a test on trajectories: whether it uses training data, how far its runs are outside of
// their range, and the accuracy of its data.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "files/trajectories.h"

namespace dpde::training {

struct TestConditions {
  bool knows_training = false;  // the training data are available
  bool is_training_file = false;
  std::vector<int> known_runs;  // runs of the test that have the first frame and parameters of a training run
  /// A parameter of runs, or "rms of u": RMS of a state in the first frames.
  struct Outside {
    std::string what;
    double low = 0, high = 0;         // over all training runs; for a state over all their frames
    std::map<int, double> runs = {};  // runs of the test outside the range
  };
  std::vector<Outside> outside;
  std::map<std::string, files::Trajectories::OwnError> own_errors;  // errors of the test's data, by variable
  int steps_of_windows = 0, steps = 0;                              // lengths of the training samples and of the test
};

/// Conditions of tests on `on`, except their steps. `learnt`: training data, or null if not available.
TestConditions conditions_of(const files::Trajectories* learnt, const files::Trajectories& on);

}  // namespace dpde::training
