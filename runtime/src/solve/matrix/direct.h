// SPDX-License-Identifier: Apache-2.0
// Sparse factors, by Eigen. Of each singular part one cell is held at 0. Where rows sum to 0 and columns do not, or the
// other way round, the small system is inverted as a whole.
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
  /// \throws dpde::Error where the operator is singular in another way, or lopsided and large.
  DirectSolver(const StencilMatrix& matrix, const NullSpace& null_space, double rounding);

  /// Of another matrix of the same grid with the same entries that are not 0, which decide the order of columns:
  /// whether there are factors. Eigen takes memory for them anew.
  bool renew(const StencilMatrix& matrix, const NullSpace& null_space);
  bool is_dense() const { return is_dense_; }
  /// `b` is compatible, but for the dense inverse; of `x` the null space is still to be removed.
  void solve(std::span<const double> b, std::span<double> x);

 private:
  /// `size`: of the largest column.
  bool is_singular(double size);
  bool holds_as_before(const NullSpace& null_space) const;
  std::int64_t entries_of(const StencilMatrix& matrix) const;
  void solve_by_factors();

  std::optional<SparseFactors> factors_;  // none where all cells are held
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> inverse_;
  bool is_dense_ = false;
  std::vector<std::uint32_t> free_;   // cells that are not held
  std::vector<std::int64_t> places_;  // of cells among these; -1: held
  std::int64_t entries_ = 0;
  Eigen::VectorXd right_, solution_;
};

}  // namespace dpde
