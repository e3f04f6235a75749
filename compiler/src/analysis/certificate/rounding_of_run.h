// SPDX-License-Identifier: Apache-2.0
// How far rounding alone moves the loss of a run and its derivative. A loss that is 0 because its terms cancel, as that
// of a velocity on a wall that it does not cross, has no size of its own, nor has its derivative: what is computed of
// both is rounding of terms, the same for all unknowns close by. So the run is made again by the reference interpreter,
// there and back, with the result of every operation moved by a rounding or so: terms that cancel leave theirs.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "driver/scene/session.h"

namespace dpde::analysis {

struct RunRounding {
  double loss = 0, derivative = 0;
};
/// At x, of the derivative in the direction; 0 where no such run can be made, or a choice changes between them, which
/// is not rounding.
RunRounding rounding_of_run(const SourceFile& source, const driver::Compiled& compiled,
                            const driver::SessionOptions& options, const Eigen::VectorXd& x,
                            const Eigen::VectorXd& direction);
/// What both are at most, `epsilon` being the distance of 1 to the next number.
double largest_rounding_of_run(double epsilon, const Eigen::VectorXd& x, const Eigen::VectorXd& direction);

}  // namespace dpde::analysis
