// SPDX-License-Identifier: Apache-2.0
// The state from which a run is resumed.
#pragma once

#include <vector>

namespace dpde {

/// State of the step-size controller under a tolerance: the next length to try, the error of the last substep, and
/// whether a substep was rejected since.
struct StepController {
  double length = 0, error = 1;
  bool has_refused = false;
};

/// A present state with everything that the next step depends on.
struct Reached {
  int step = 0;
  std::vector<std::vector<double>> states;  // interior values, x fastest, in the order of Simulation::states()
  StepController controller;
};

}  // namespace dpde
