// SPDX-License-Identifier: Apache-2.0
// Matrices whose entries lie near the diagonal, eliminated with exchanges of rows (Golub and Van Loan, 4.3.3).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace dpde {

class BandedMatrix {
 public:
  BandedMatrix() = default;
  /// Of entries at most `width` beside the diagonal.
  BandedMatrix(std::int64_t size, std::int64_t width);

  void set_zero();
  double& entry(std::int64_t row, std::int64_t column) { return values_[place(row, column)]; }
  /// In place; false where it is singular.
  bool factor();
  /// Behind `factor`; `x` is the right side before.
  void solve(std::span<double> x) const;
  /// Of memory.
  std::int64_t bytes() const { return static_cast<std::int64_t>(8 * (values_.size() + pivots_.size())); }

 private:
  /// Columns one behind the other, with room above for what exchanges bring.
  std::size_t place(std::int64_t row, std::int64_t column) const {
    return static_cast<std::size_t>(column * stride_ + row - column + 2 * width_);
  }
  std::int64_t rows_below(std::int64_t column) const;

  std::int64_t size_ = 0, width_ = 0, stride_ = 0;
  std::vector<double> values_;
  std::vector<std::int64_t> pivots_;
};

}  // namespace dpde
