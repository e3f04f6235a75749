// SPDX-License-Identifier: Apache-2.0
// Eigenvalues of Hessenberg matrices, and nothing else of them: the QR method on what is not yet split off (G. H. Golub
// and C. F. Van Loan, Matrix Computations, 7.5). A Schur form, which Eigen makes, also turns all the rest.
#pragma once

#include <Eigen/Core>
#include <complex>

namespace dpde::stability {

/// That of std::complex looks for infinities.
inline std::complex<double> product(const std::complex<double>& a, const std::complex<double>& b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
inline double product(double a, double b) { return a * b; }

/// By Francis' double shifts. Empty where they do not converge, as of what is not finite.
Eigen::VectorXcd hessenberg_eigenvalues(Eigen::MatrixXd h);
/// By Wilkinson's shifts. Likewise.
Eigen::VectorXcd hessenberg_eigenvalues(Eigen::MatrixXcd h);

}  // namespace dpde::stability
