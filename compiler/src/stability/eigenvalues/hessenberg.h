// SPDX-License-Identifier: Apache-2.0
// Eigenvalues of Hessenberg matrices, without eigenvectors: the QR method on the active block only (G. H. Golub and
// C. F. Van Loan, Matrix Computations, 7.5). Eigen's Schur form also transforms the rest of the matrix.
#pragma once

#include <Eigen/Core>
#include <complex>

namespace dpde::stability {

/// The product of std::complex checks for infinities, which is slow.
inline std::complex<double> product(const std::complex<double>& a, const std::complex<double>& b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
inline double product(double a, double b) { return a * b; }

/// With Francis' double shifts. Empty if they do not converge, as with values that are not finite.
Eigen::VectorXcd hessenberg_eigenvalues(Eigen::MatrixXd h);
/// With Wilkinson's shifts. Empty if they do not converge.
Eigen::VectorXcd hessenberg_eigenvalues(Eigen::MatrixXcd h);

}  // namespace dpde::stability
