// SPDX-License-Identifier: Apache-2.0
// Banded matrices, eliminated with partial pivoting (Golub and Van Loan, 4.3.3).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace dpde {

class BandedMatrix {
 public:
  BandedMatrix() = default;
  /// `width`: largest distance of an entry from the diagonal.
  BandedMatrix(std::int64_t size, std::int64_t width);

  void set_zero();
  double& entry(std::int64_t row, std::int64_t column) { return values_[place(row, column)]; }
  /// Factorises in place; returns false if the matrix is singular.
  bool factor();
  /// After factor(). On entry `x` is the right side.
  void solve(std::span<double> x) const;
  /// Memory use.
  std::int64_t bytes() const { return static_cast<std::int64_t>(8 * (values_.size() + pivots_.size())); }

 private:
  /// Column by column, with space above for row exchanges.
  std::size_t place(std::int64_t row, std::int64_t column) const {
    return static_cast<std::size_t>(column * stride_ + row - column + 2 * width_);
  }
  std::int64_t rows_below(std::int64_t column) const;

  std::int64_t size_ = 0, width_ = 0, stride_ = 0;
  std::vector<double> values_;
  std::vector<std::int64_t> pivots_;
};

}  // namespace dpde
