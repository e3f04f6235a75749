// SPDX-License-Identifier: Apache-2.0
// Operators with the same row in all cells. Beyond bounded axes a field goes on as its even or odd image: walls with
// zero slope or value half a cell outside.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "solve/line_waves.h"
#include "solve/stencil_matrix.h"

namespace dpde {

class ConstantRows {
 public:
  /// Nothing where the rows are not alike, or differ beside walls from what images make of them.
  static std::optional<ConstantRows> of(const StencilMatrix& matrix, double rounding);

  const std::array<std::int64_t, 3>& cells() const { return cells_; }
  const std::array<Sides, 3>& sides() const { return sides_; }
  const std::vector<std::array<int, 3>>& offsets() const { return offsets_; }
  const std::vector<double>& row() const { return row_; }
  /// Whether offsets mirrored at these axes have the same entries, but for `zero`.
  bool is_even(const std::array<bool, 3>& mirrored, double zero) const;
  /// |b - A*x|
  double residual(std::span<const double> b, std::span<const double> x);

 private:
  /// What an offset makes of the cells of a line: the line that it reads, and how far along it.
  struct Line {
    const double* values;
    double factor;
    std::int64_t shift;
  };

  ConstantRows(const StencilMatrix& matrix, const std::vector<double>& row, const std::array<Sides, 3>& sides);
  std::pair<std::int64_t, double> image(std::size_t axis, std::int64_t place) const;
  double left_of_cell(double b, std::int64_t x) const;
  double squared_left_of_line(const double* b) const;

  std::array<std::int64_t, 3> cells_;
  std::array<Sides, 3> sides_;
  std::vector<std::array<int, 3>> offsets_;
  std::vector<double> row_;
  std::int64_t reach_ = 0;  // along x
  std::vector<Line> lines_;
};

}  // namespace dpde
