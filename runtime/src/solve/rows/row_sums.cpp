// SPDX-License-Identifier: Apache-2.0
#include "solve/rows/row_sums.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace dpde {
namespace {

constexpr std::array odd_factors{3.0, 5.0, 7.0, 11.0, 13.0};

struct Row {
  double sum = 0, size = 0, largest = 0;

  void add(double value) {
    sum += value;
    size += std::abs(value);
    largest = std::max(largest, std::abs(value));
  }
  /// Whether a sum may be rounding: that of entries, a few units in the last place of the largest, or that of their sum
  /// in f64.
  bool may_be_rounding(double of, double rounding) const {
    return std::abs(of) <= std::max(8 * rounding * largest, 64 * 0x1p-52 * size);
  }
};

Row row_of(const StencilMatrix& matrix, std::size_t cell) {
  Row row;
  for (const std::vector<double>& column : matrix.values) row.add(column[cell]);
  return row;
}

/// Sets `sums` to 0 that are rounding; sums[i] is that of `cells[i]`, whose row has the largest entry `largest[i]`.
void drop_rounding(const LinearImage& image, std::span<const std::size_t> cells, std::span<const double> largest,
                   std::span<double> sums, std::span<double> values, std::span<double> made) {
  double noise = 0;  // relative to the largest entry
  for (const double factor : odd_factors) {
    std::ranges::fill(values, factor);
    image(values, made);
    for (std::size_t i = 0; i < cells.size(); ++i)
      noise = std::max(noise, std::abs(made[cells[i]] / factor - sums[i]) / largest[i]);
  }
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (std::abs(sums[i]) <= 4 * noise * largest[i]) sums[i] = 0;
  }
}

}  // namespace

void row_sums(const LinearImage& image, const StencilMatrix& matrix, double rounding, std::span<double> ones,
              std::span<double> made, DoubtfulSums& doubtful) {
  std::ranges::fill(ones, 1.0);
  image(ones, made);
  doubtful.cells.clear();
  doubtful.largest.clear();
  doubtful.sums.clear();
  for (std::size_t cell = 0; cell < made.size(); ++cell) {
    const Row row = row_of(matrix, cell);
    if (row.largest == 0) made[cell] = 0;
    if (made[cell] == 0 || !row.may_be_rounding(made[cell], rounding)) continue;
    doubtful.cells.push_back(cell);
    doubtful.largest.push_back(row.largest);
    doubtful.sums.push_back(made[cell]);
  }
  if (doubtful.cells.empty()) return;
  drop_rounding(image, doubtful.cells, doubtful.largest, doubtful.sums, ones, made);
  std::ranges::fill(ones, 1.0);  // one more application, but no memory for the first one
  image(ones, made);
  for (std::size_t cell = 0; cell < made.size(); ++cell) {
    if (row_of(matrix, cell).largest == 0) made[cell] = 0;
  }
  for (std::size_t i = 0; i < doubtful.cells.size(); ++i) made[doubtful.cells[i]] = doubtful.sums[i];
}

std::vector<double> row_sums(const StencilMatrix& matrix, double rounding) {
  std::vector<double> sums(static_cast<std::size_t>(matrix.size()));
  for (std::size_t cell = 0; cell < sums.size(); ++cell) {
    const Row row = row_of(matrix, cell);
    sums[cell] = row.may_be_rounding(row.sum, rounding) ? 0 : row.sum;
  }
  return sums;
}

double row_sum(const LinearImage& image, const ConstantRows& rows, std::size_t cell, double sum, double rounding,
               std::span<double> values, std::span<double> made) {
  Row row;
  for (const double value : rows.row()) row.add(value);
  if (sum == 0 || !row.may_be_rounding(sum, rounding)) return sum;
  const std::array cells{cell};
  std::array sums{sum};
  drop_rounding(image, cells, std::array{row.largest}, sums, values, made);
  return sums.front();
}

void balance(StencilMatrix& matrix, std::span<const double> sums, double rounding) {
  const auto middle = std::ranges::find(matrix.offsets, std::array{0, 0, 0});
  if (middle == matrix.offsets.end()) return;
  std::vector<double>& diagonal = matrix.values[static_cast<std::size_t>(middle - matrix.offsets.begin())];
  for (std::size_t cell = 0; cell < sums.size(); ++cell) {
    const Row row = row_of(matrix, cell);
    if (std::abs(row.sum - sums[cell]) <= 64 * rounding * row.size) diagonal[cell] += sums[cell] - row.sum;
  }
}

}  // namespace dpde
