// SPDX-License-Identifier: Apache-2.0
#include "solve/half_rows.h"

namespace dpde {

HalfRows::HalfRows(std::int64_t cells, bool is_ring) : cells_(cells), is_ring_(is_ring) {
  constexpr std::int64_t line = 8;  // numbers in a cache line
  const auto rounded = [](std::int64_t n) { return (n + line - 1) / line * line; };
  odd_ = rounded(count(0) + 2);
  stride_ = odd_ + rounded(count(1) + 1);
}

void HalfRows::pack(const double* cells, double factor, double* even, double* odd) const {
  const std::int64_t pairs = count(1);
  for (std::int64_t i = 0; i < pairs; ++i) even[i] = factor * cells[2 * i], odd[i] = factor * cells[2 * i + 1];
  if (cells_ % 2 == 1) even[pairs] = factor * cells[2 * pairs];
}

void HalfRows::unpack(const double* even, const double* odd, double* cells) const {
  const std::int64_t pairs = count(1);
  for (std::int64_t i = 0; i < pairs; ++i) cells[2 * i] = even[i], cells[2 * i + 1] = odd[i];
  if (cells_ % 2 == 1) cells[2 * pairs] = even[pairs];
}

}  // namespace dpde
