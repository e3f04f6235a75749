// SPDX-License-Identifier: Apache-2.0
// Effect of rounding on the loss of a run and on its derivative. If a loss is 0 because its terms cancel, as for a
// velocity normal to a wall, neither it nor its derivative has a size of its own. Both are then rounding of terms, and
// the same at all nearby points. So the reference interpreter repeats the run, forward and reverse, with the result of
// every operation perturbed by about a rounding.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "driver/scene/session.h"

namespace dpde::analysis {

struct RunRounding {
  double loss = 0, derivative = 0;
};
/// At x, for the derivative in `direction`. 0 if no such run is possible, or if a choice changes between runs, which is
/// not rounding.
RunRounding rounding_of_run(const SourceFile& source, const driver::Compiled& compiled,
                            const driver::SessionOptions& options, const Eigen::VectorXd& x,
                            const Eigen::VectorXd& direction);
/// Upper bound of both; `epsilon`: machine epsilon.
double largest_rounding_of_run(double epsilon, const Eigen::VectorXd& x, const Eigen::VectorXd& direction);

}  // namespace dpde::analysis
