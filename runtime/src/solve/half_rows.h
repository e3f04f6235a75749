// SPDX-License-Identifier: Apache-2.0
// Rows along x in two halves, the cells of even x first. A sweep over one colour of a chequered grid is then a loop
// without gaps. Before the second half and behind both is room for the cell around the ring; between bounded ends it
// stays 0. Halves of vectors lie apart (solve/row_kernels.h), of coefficients one behind the other.
#pragma once

#include <cstdint>
#include <initializer_list>

namespace dpde {

class HalfRows {
 public:
  HalfRows() = default;
  HalfRows(std::int64_t cells, bool is_ring);

  std::int64_t cells() const { return cells_; }
  std::int64_t stride() const { return stride_; }
  std::int64_t begin(int half) const { return half == 0 ? 0 : odd_; }
  std::int64_t count(int half) const { return (cells_ + 1 - half) / 2; }
  bool is_ring() const { return is_ring_; }

  void close_ring(double* row) const { close_ring(row, row + odd_); }
  void close_ring(double* even, double* odd) const {
    for (const int half : {0, 1}) close_ring(even, odd, half);
  }
  /// What follows from the cells of one half; others are not touched.
  void close_ring(double* even, double* odd, int half) const {
    if (!is_ring_) return;
    const bool is_last_odd = cells_ % 2 == 0;
    if (is_last_odd && half == 1) odd[-1] = odd[count(1) - 1];
    if (is_last_odd && half == 0) even[count(0)] = even[0];
    if (!is_last_odd && half == 0) odd[-1] = even[count(0) - 1], odd[count(1)] = even[0];
  }
  /// row = factor*cells; the rooms stay as they are.
  void pack(const double* cells, double factor, double* row) const { pack(cells, factor, row, row + odd_); }
  void pack(const double* cells, double factor, double* even, double* odd) const;
  void unpack(const double* even, const double* odd, double* cells) const;

 private:
  std::int64_t cells_ = 0, odd_ = 0, stride_ = 0;
  bool is_ring_ = false;
};

}  // namespace dpde
