// SPDX-License-Identifier: Apache-2.0
// The pseudo-inverse of a symmetric operator: in each singular part one cell is fixed. For few cells a dense inverse,
// for more sparse factors L*D*L^T by Eigen. Solves allocate nothing, and for few cells neither do other operators of
// the same grid.
#pragma once

#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "solve/matrix/null_space.h"
#include "solve/matrix/stencil_matrix.h"

namespace dpde {

class SymmetricFactors {
 public:
  static constexpr std::size_t few = 64;  // cells: 32 KiB

  /// `write`(matrix) writes to the memory of the previous matrix. `sums`: of its rows. False if it is singular in
  /// another way.
  template <class Write>
  bool set(const Write& write, std::span<const double> sums) {
    write(matrix_);
    return find(sums);
  }
  /// Makes `b` compatible.
  void solve(std::span<double> b, std::span<double> x);

 private:
  bool find(std::span<const double> sums);
  bool invert();
  bool factor();
  void solve_by_factors(std::span<const double> b, std::span<double> x);

  StencilMatrix matrix_;
  NullSpace null_space_;
  NullSpaceMemory memory_;
  std::vector<double> inverse_;        // for few cells: the inverse, row by row; else 1/D
  Eigen::SparseMatrix<double> lower_;  // L; its diagonal is 1
  std::vector<std::uint32_t> cells_;   // the cell of each row of L
  std::vector<double> values_;
};

}  // namespace dpde
