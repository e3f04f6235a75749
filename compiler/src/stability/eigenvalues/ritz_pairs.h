// SPDX-License-Identifier: Apache-2.0
// Ritz values and vectors of a step on a Krylov space (Y. Saad, Numerical Methods for Large Eigenvalue Problems, 2011,
// 4.3).
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>

#include "stability/step/tangent_runs.h"

namespace dpde::stability {

struct RitzPair {
  std::complex<double> value;
  Eigen::MatrixXd vector;  // for a complex pair: a real vector in their plane
};

/// The pair of the largest Ritz value. nullopt: the space is empty, or no eigenvalues are found. `like`: a matrix of
/// the vector's shape.
std::optional<RitzPair> largest_pair(const KrylovSpace& space, const Eigen::MatrixXd& like);
/// The pair whose vector is nearest to the first basis vector, the start of the space.
std::optional<RitzPair> nearest_pair(const KrylovSpace& space, const Eigen::MatrixXd& like);

}  // namespace dpde::stability
