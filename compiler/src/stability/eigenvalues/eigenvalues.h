// SPDX-License-Identifier: Apache-2.0
// Eigenvalues of small dense matrices.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <vector>

namespace dpde::stability {

/// Rows and columns are balanced first, as states have units. Two close eigenvalues of a 2 x 2 matrix, as those of long
/// waves, are exact to rounding. Up to 4 x 4 only the result is allocated: hundreds of thousands of waves are
/// evaluated.
Eigen::VectorXcd eigenvalues(Eigen::MatrixXcd a);
Eigen::VectorXcd eigenvalues(Eigen::MatrixXd a);
/// Eigenvalues of a Krylov space's matrix, without balancing: its scales would follow rounding errors far from the
/// diagonal and spread them (D. S. Watkins, "A case where balancing is harmful", ETNA 23 (2006) 1).
Eigen::VectorXcd eigenvalues_of_space(Eigen::MatrixXd hessenberg);
/// The polynomial, with coefficients by increasing power, at each value.
Eigen::VectorXcd polynomial_of(const std::vector<double>& polynomial, const Eigen::VectorXcd& values);
/// The scales of balancing: a(i, k) becomes a(i, k)*scales[k]/scales[i].
Eigen::VectorXd scales_of(Eigen::MatrixXd a);
/// Diagonals of matrices that one change of basis makes upper triangular, as is possible if they commute; a column per
/// matrix. A row has one eigenvalue of each; sums of these are eigenvalues of sums of the matrices. nullopt if more
/// than rounding remains below the diagonals.
std::optional<Eigen::MatrixXcd> common_diagonals(std::vector<Eigen::MatrixXd> matrices);
/// The index of the largest component of the eigenvector of the largest eigenvalue.
Eigen::Index largest_component(Eigen::MatrixXcd a);
/// The condition number of an eigenvalue of the balanced `a`, for relative changes of `a`: |a| |x| |y| / |y.x|, with
/// its right and left eigenvectors x and y (G. H. Golub and C. F. Van Loan, Matrix Computations, 7.2.2).
double sensitivity(Eigen::MatrixXd a, std::complex<double> value);
/// What the eigenvalues of all matrices next to `a` have in common; next to it: balanced, they differ by up to
/// `rounding` |a|. Eigenvalues may be multiple: only groups are told apart. The number outside a circle, or on the
/// right of a line, is the same in all these matrices if rounding |a| |(z - a)^-1| < 1 for all z on it (L. N. Trefethen
/// and M. Embree, Spectra and Pseudospectra, 2005, chapter 2).
class SureSpectrum {
 public:
  /// Boundaries are circles about 0 for the factors of a step, vertical lines for rates.
  enum class Of { factors, rates };
  SureSpectrum(Eigen::MatrixXd a, Of kind, double rounding);
  /// Whether at least `count` >= 1 are surely beyond the boundary.
  bool are_beyond(double boundary, Eigen::Index count) const;
  /// The largest boundary up to `most` that is surely between eigenvalues; if there is none, one that all are beyond.
  double boundary_within(double most) const;
  /// The largest modulus or real part.
  double largest() const { return size_of(values_[0]); }

 private:
  double size_of(std::complex<double> value) const { return kind_ == Of::rates ? value.real() : std::abs(value); }
  bool is_boundary(double at) const;

  Eigen::MatrixXd hessenberg_;  // of the balanced matrix
  Eigen::VectorXcd values_;     // by decreasing size
  Of kind_;
  double error_;
};
/// A bound on the error of the largest Ritz value as an eigenvalue of the operator: |x|/|y.x| times the residual, which
/// is `rest` times the last component of its vector (Y. Saad, Numerical Methods for Large Eigenvalue Problems, 2011,
/// 6.2), or times the worst rounding error. A double eigenvalue moves by the root of that.
double error_of_space(Eigen::MatrixXd a, std::complex<double> value, double rest, double rounding);

}  // namespace dpde::stability
