// SPDX-License-Identifier: Apache-2.0
#include "stability/eigenvalues/ritz_pairs.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace dpde::stability {

namespace {

using Solver = Eigen::EigenSolver<Eigen::MatrixXd>;

/// The phase is chosen so that the largest component in the basis is real.
RitzPair pair_of(const KrylovSpace& space, const Solver& solved, Eigen::Index which, const Eigen::MatrixXd& like) {
  Eigen::VectorXcd vector = solved.eigenvectors().col(which);
  Eigen::Index largest = 0;
  vector.cwiseAbs().maxCoeff(&largest);
  vector *= std::conj(vector[largest]) / std::abs(vector[largest]);
  const Eigen::VectorXd all = space.basis * vector.real();
  return {solved.eigenvalues()[which], all.reshaped(like.rows(), like.cols())};
}

}  // namespace

std::optional<RitzPair> largest_pair(const KrylovSpace& space, const Eigen::MatrixXd& like) {
  if (space.matrix.rows() == 0) return std::nullopt;
  const Solver solved(space.matrix);
  if (solved.info() != Eigen::Success) return std::nullopt;
  Eigen::Index which = 0;
  solved.eigenvalues().cwiseAbs().maxCoeff(&which);
  return pair_of(space, solved, which, like);
}

std::optional<RitzPair> nearest_pair(const KrylovSpace& space, const Eigen::MatrixXd& like) {
  if (space.matrix.rows() == 0) return std::nullopt;
  const Solver solved(space.matrix);
  if (solved.info() != Eigen::Success) return std::nullopt;
  Eigen::Index which = 0;
  solved.eigenvectors().row(0).cwiseAbs().maxCoeff(&which);
  return pair_of(space, solved, which, like);
}

}  // namespace dpde::stability
