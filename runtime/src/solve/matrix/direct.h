// SPDX-License-Identifier: Apache-2.0
// Sparse LU factors, by Eigen. In each singular part one cell is fixed to 0. If rows sum to 0 and columns do not, or
// vice versa, the system must be small and is inverted as a dense matrix.
#pragma once

#include <Eigen/QR>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "solve/matrix/null_space.h"
#include "solve/matrix/sparse_factors.h"
#include "solve/matrix/stencil_matrix.h"

namespace dpde {

class DirectSolver {
 public:
  /// \throws dpde::Error if the operator is singular in another way, or lopsided and large.
  DirectSolver(const StencilMatrix& matrix, const NullSpace& null_space, double rounding);

  /// Refactorises for another matrix of the same grid with the same nonzero entries, which decide the order of columns.
  /// Returns whether there are factors. Eigen allocates their memory again.
  bool renew(const StencilMatrix& matrix, const NullSpace& null_space);
  bool is_dense() const { return is_dense_; }
  /// `b` must be compatible, except for the dense inverse; the null space must still be removed from `x`.
  void solve(std::span<const double> b, std::span<double> x);

 private:
  /// `size`: norm of the largest column.
  bool is_singular(double size);
  bool holds_as_before(const NullSpace& null_space) const;
  std::int64_t entries_of(const StencilMatrix& matrix) const;
  void solve_by_factors();

  std::optional<SparseFactors> factors_;  // empty if all cells are fixed
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> inverse_;
  bool is_dense_ = false;
  std::vector<std::uint32_t> free_;   // cells that are not fixed
  std::vector<std::int64_t> places_;  // index of each cell among these; -1: fixed
  std::int64_t entries_ = 0;
  Eigen::VectorXd right_, solution_;
};

}  // namespace dpde
