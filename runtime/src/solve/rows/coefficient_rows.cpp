// SPDX-License-Identifier: Apache-2.0
#include "solve/rows/coefficient_rows.h"

#include <bit>
#include <cstring>
#include <functional>
#include <limits>
#include <string_view>

namespace dpde {

/// Hash table with linear probing (Knuth, The Art of Computer Programming 3, 6.4, algorithm L).
std::size_t RowNumbers::find(std::size_t length, std::span<const double> values) {
  constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  const std::size_t count = values.size() / length, bytes = length * sizeof(double);
  of_row.resize(count);
  table.assign(std::bit_ceil(2 * count), none);
  std::size_t different = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double* const row = values.data() + i * length;
    std::size_t at = std::hash<std::string_view>()({reinterpret_cast<const char*>(row), bytes});
    const auto known = [&]() -> std::uint32_t& { return table[at & (table.size() - 1)]; };
    while (known() != none && std::memcmp(values.data() + known() * length, row, bytes) != 0) ++at;
    if (known() == none) {
      known() = static_cast<std::uint32_t>(i);
      of_row[i] = static_cast<std::uint32_t>(different++);
    } else {
      of_row[i] = of_row[known()];
    }
  }
  return different;
}

template <class Real>
void CoefficientRows<Real>::set(const HalfRows& rows, std::span<const double> values, double factor) {
  const auto length = static_cast<std::size_t>(rows.cells()), stride = static_cast<std::size_t>(rows.stride());
  const std::size_t different = numbers_.find(length, values);
  if (kept_.size() < different * stride) kept_ = NumbersOf<Real>(different * stride);
  rows_.resize(numbers_.of_row.size());
  std::size_t packed = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Real* const to = kept_.data() + numbers_.of_row[i] * stride;
    if (numbers_.of_row[i] == packed) {
      rows.pack(values.data() + i * length, factor, to);
      rows.close_ring(to);
      ++packed;
    }
    rows_[i] = to;
  }
}

template class CoefficientRows<double>;
template class CoefficientRows<float>;

}  // namespace dpde
