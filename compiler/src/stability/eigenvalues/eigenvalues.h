// SPDX-License-Identifier: Apache-2.0
// Eigenvalues of small dense matrices.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <vector>

namespace dpde::stability {

/// Rows and columns are first scaled to one size: states have units. Exact to rounding where two of a 2 x 2 matrix lie
/// close together, as those of long waves do. Up to 4 x 4 nothing is allocated but the result: waves are looked at by
/// the hundred thousand.
Eigen::VectorXcd eigenvalues(Eigen::MatrixXcd a);
Eigen::VectorXcd eigenvalues(Eigen::MatrixXd a);
/// Of a Krylov space's matrix, as it is: scales would be those of entries that rounding has left far from the diagonal,
/// and spread their errors (D. S. Watkins, "A case where balancing is harmful", ETNA 23 (2006) 1).
Eigen::VectorXcd eigenvalues_of_space(Eigen::MatrixXd hessenberg);
/// A polynomial, given by powers, of each of these.
Eigen::VectorXcd polynomial_of(const std::vector<double>& polynomial, const Eigen::VectorXcd& values);
/// Of that scaling: a(i, k) becomes a(i, k)*scales[k]/scales[i].
Eigen::VectorXd scales_of(Eigen::MatrixXd a);
/// Of matrices that one change of basis makes triangular, as it does all that commute: their diagonals in it, a column
/// each. Row by row they are eigenvalues, of sums of the matrices too. nullopt where more than rounding is left below.
std::optional<Eigen::MatrixXcd> common_diagonals(std::vector<Eigen::MatrixXd> matrices);
/// The component that has the largest share in the eigenvector of the largest eigenvalue.
Eigen::Index largest_component(Eigen::MatrixXcd a);
/// What a relative change of `a`, scaled as above, is multiplied by in this eigenvalue of it: |a| |x| |y| / |y.x|, with
/// its right and left vectors x and y (G. H. Golub and C. F. Van Loan, Matrix Computations, 7.2.2).
double sensitivity(Eigen::MatrixXd a, std::complex<double> value);
/// How much larger the largest eigenvalue of a Krylov space's matrix may be than one of the operator: |x|/|y.x| times
/// what the operator makes of its vector beside the space, `rest` times the last component (Y. Saad, Numerical Methods
/// for Large Eigenvalue Problems, 2011, 6.2), or what rounding makes of it at worst. A double one moves by its root.
double error_of_space(Eigen::MatrixXd a, std::complex<double> value, double rest, double rounding);

}  // namespace dpde::stability
