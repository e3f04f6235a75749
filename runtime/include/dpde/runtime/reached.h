// SPDX-License-Identifier: Apache-2.0
// Where steps have come to, for a run that goes on there.
#pragma once

#include <vector>

namespace dpde {

/// What decides on the next part of a step under a tolerance: the length that is tried, the error of the last one, and
/// whether one was refused since.
struct StepController {
  double length = 0, error = 1;
  bool has_refused = false;
};

struct Reached {
  int step = 0;
  std::vector<std::vector<double>> states;  // interior values, x fastest, in the order of Simulation::states()
  StepController controller;
};

}  // namespace dpde
