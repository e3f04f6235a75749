// SPDX-License-Identifier: Apache-2.0
#include "solve/coefficient_rows.h"

#include <string_view>
#include <unordered_map>

namespace dpde {

CoefficientRows::CoefficientRows(const HalfRows& rows, std::span<const double> values) {
  const auto length = static_cast<std::size_t>(rows.cells());
  std::unordered_map<std::string_view, std::size_t> known;  // the bytes of a row: its number among the kept ones
  std::vector<const double*> different;
  std::vector<std::size_t> number;
  for (std::size_t at = 0; at < values.size(); at += length) {
    const double* row = values.data() + at;
    const std::string_view bytes(reinterpret_cast<const char*>(row), length * sizeof(double));
    const auto [found, is_new] = known.try_emplace(bytes, different.size());
    if (is_new) different.push_back(row);
    number.push_back(found->second);
  }
  const auto stride = static_cast<std::size_t>(rows.stride());
  kept_ = Numbers(different.size() * stride);
  for (std::size_t i = 0; i < different.size(); ++i) {
    rows.pack(different[i], 1, kept_.data() + i * stride);
    rows.close_ring(kept_.data() + i * stride);
  }
  for (const std::size_t i : number) rows_.push_back(kept_.data() + i * stride);
}

}  // namespace dpde
