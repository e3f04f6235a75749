// SPDX-License-Identifier: Apache-2.0
// Eigenvalues of small dense matrices.
#pragma once

#include <Eigen/Core>

namespace dpde::stability {

/// Rows and columns are first scaled to one size: states have units. Exact to rounding where two of a 2 x 2 matrix lie
/// close together, as those of long waves do. Up to 4 x 4 nothing is allocated but the result: waves are looked at by
/// the hundred thousand.
Eigen::VectorXcd eigenvalues(Eigen::MatrixXcd a);
Eigen::VectorXcd eigenvalues(Eigen::MatrixXd a);
/// The component that has the largest share in the eigenvector of the largest eigenvalue.
Eigen::Index largest_component(Eigen::MatrixXcd a);

}  // namespace dpde::stability
