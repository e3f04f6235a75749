// SPDX-License-Identifier: Apache-2.0
#include "solve/coefficient_rows.h"

#include <bit>
#include <cstring>
#include <functional>
#include <limits>
#include <string_view>

namespace dpde {

/// The same number for rows of the same bytes, in the order in which they come; how many there are. Rows are found by
/// their hash, in the next place that is free (Knuth, The Art of Computer Programming 3, 6.4, algorithm L).
std::size_t CoefficientRows::number_rows(std::size_t length, std::span<const double> values) {
  constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  const std::size_t count = values.size() / length, bytes = length * sizeof(double);
  number_.resize(count);
  table_.assign(std::bit_ceil(2 * count), none);
  std::size_t different = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double* const row = values.data() + i * length;
    std::size_t at = std::hash<std::string_view>()({reinterpret_cast<const char*>(row), bytes});
    const auto known = [&]() -> std::uint32_t& { return table_[at & (table_.size() - 1)]; };
    while (known() != none && std::memcmp(values.data() + known() * length, row, bytes) != 0) ++at;
    if (known() == none) {
      known() = static_cast<std::uint32_t>(i);
      number_[i] = static_cast<std::uint32_t>(different++);
    } else {
      number_[i] = number_[known()];
    }
  }
  return different;
}

void CoefficientRows::set(const HalfRows& rows, std::span<const double> values) {
  const auto length = static_cast<std::size_t>(rows.cells()), stride = static_cast<std::size_t>(rows.stride());
  const std::size_t different = number_rows(length, values);
  if (kept_.size() < different * stride) kept_ = Numbers(different * stride);
  rows_.resize(number_.size());
  std::size_t packed = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    double* const to = kept_.data() + number_[i] * stride;
    if (number_[i] == packed) {
      rows.pack(values.data() + i * length, 1, to);
      rows.close_ring(to);
      ++packed;
    }
    rows_[i] = to;
  }
}

}  // namespace dpde
