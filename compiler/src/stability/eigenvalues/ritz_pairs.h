// SPDX-License-Identifier: Apache-2.0
// Eigenvalues of a step on a Krylov space with their vectors (Y. Saad, Numerical Methods for Large Eigenvalue Problems,
// 2011, 4.3).
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>

#include "stability/step/tangent_runs.h"

namespace dpde::stability {

struct RitzPair {
  std::complex<double> value;
  Eigen::MatrixXd vector;  // of two that are one another's conjugates one in their plane
};

/// Of the largest. nullopt: the space is empty, or no eigenvalues are found. `like`: a matrix of the vector's shape.
std::optional<RitzPair> largest_pair(const KrylovSpace& space, const Eigen::MatrixXd& like);
/// Of the vector that is nearest to the first of the basis, where the space began.
std::optional<RitzPair> nearest_pair(const KrylovSpace& space, const Eigen::MatrixXd& like);

}  // namespace dpde::stability
