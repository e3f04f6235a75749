// SPDX-License-Identifier: Apache-2.0
// Rows along x in two halves, the cells of even x first, so that a sweep over one colour of a red-black grid is a loop
// without gaps. Before the second half and after both there is space for the periodic neighbour; with bounded ends it
// stays 0. Halves of vectors are separate (solve/rows/row_kernels.h), those of coefficients contiguous.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <type_traits>

namespace dpde {

/// In a cache line.
template <class Real>
inline constexpr std::int64_t numbers_of_line = 64 / sizeof(Real);

class HalfRows {
 public:
  HalfRows() = default;
  /// `line`: numbers in a cache line.
  HalfRows(std::int64_t cells, bool is_ring, std::int64_t line = 8);

  std::int64_t cells() const { return cells_; }
  std::int64_t stride() const { return stride_; }
  std::int64_t begin(int half) const { return half == 0 ? 0 : odd_; }
  std::int64_t count(int half) const { return (cells_ + 1 - half) / 2; }
  bool is_ring() const { return is_ring_; }

  template <class Real>
  void close_ring(Real* row) const {
    close_ring(row, row + odd_);
  }
  template <class Real>
  void close_ring(Real* even, Real* odd) const {
    for (const int half : {0, 1}) close_ring(even, odd, half);
  }
  /// Updates only the periodic neighbours that are cells of one half.
  template <class Real>
  void close_ring(Real* even, Real* odd, int half) const {
    if (!is_ring_) return;
    const bool is_last_odd = cells_ % 2 == 0;
    if (is_last_odd && half == 1) odd[-1] = odd[count(1) - 1];
    if (is_last_odd && half == 0) even[count(0)] = even[0];
    if (!is_last_odd && half == 0) odd[-1] = even[count(0) - 1], odd[count(1)] = even[0];
  }
  /// Sets to 0 what close_ring() sets.
  template <class Real>
  void open_ring(Real* even, Real* odd) const {
    if (is_ring_) odd[-1] = odd[count(1)] = even[count(0)] = 0;
  }
  /// row = factor*cells; the extra spaces are not changed.
  template <class From, class To>
  void pack(const From* cells, std::type_identity_t<From> factor, To* row) const {
    pack(cells, factor, row, row + odd_);
  }
  template <class From, class To>
  void pack(const From* cells, std::type_identity_t<From> factor, To* even, To* odd) const {
    const auto made = [factor](From cell) { return static_cast<To>(factor * cell); };
    const std::int64_t pairs = count(1);
    for (std::int64_t i = 0; i < pairs; ++i) even[i] = made(cells[2 * i]), odd[i] = made(cells[2 * i + 1]);
    if (cells_ % 2 == 1) even[pairs] = made(cells[2 * pairs]);
  }

 private:
  std::int64_t cells_ = 0, odd_ = 0, stride_ = 0;
  bool is_ring_ = false;
};

}  // namespace dpde
