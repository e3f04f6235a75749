// SPDX-License-Identifier: Apache-2.0
// Sparse factors L*D*L^T of a symmetric operator, by Eigen; of each singular part one cell is held, so that a solve is
// by the pseudo-inverse. A solve allocates nothing.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "solve/null_space.h"
#include "solve/stencil_matrix.h"

namespace dpde {

class SymmetricFactors {
 public:
  /// `sums`: of its rows.
  SymmetricFactors(const StencilMatrix& matrix, std::span<const double> sums);

  bool is_there() const { return is_there_; }  // no: the operator is singular in another way
  /// `b` is made compatible.
  void solve(std::span<double> b, std::span<double> x);

 private:
  NullSpace null_space_;
  Eigen::SparseMatrix<double> lower_;  // L; its diagonal is 1
  std::vector<double> inverse_;        // 1/D
  std::vector<std::uint32_t> cells_;   // the cell of each row of L
  std::vector<double> values_;
  bool is_there_ = true;
};

}  // namespace dpde
