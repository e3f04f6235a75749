// SPDX-License-Identifier: Apache-2.0
// Point and direction of certificates: near a task's start, so that no value is on a kink by chance.
#pragma once

#include <Eigen/Core>
#include <random>

#include "driver/scene/inverse.h"

namespace dpde::analysis {

struct Point {
  Eigen::VectorXd x, direction;
};

/// The scene's own values and the task's start, each with some noise, and a direction of the size of x in every
/// unknown.
Point generic_point(driver::Session& session, const driver::Inverse& inverse, std::mt19937_64& random);

}  // namespace dpde::analysis
