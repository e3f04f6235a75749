// SPDX-License-Identifier: Apache-2.0
// Operators with the same row in all cells. Beyond bounded axes a field is continued evenly or oddly: walls with zero
// slope or zero value half a cell outside.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "solve/fourier/grid_place.h"
#include "solve/fourier/line_waves.h"
#include "solve/matrix/stencil_matrix.h"

namespace dpde {

class ConstantRows {
 public:
  ConstantRows() = default;
  /// row[k]: the entry in the column of the cell at offsets[k]; along bounded axes offsets are shorter than the axis.
  ConstantRows(const std::array<std::int64_t, 3>& cells, const std::array<Sides, 3>& sides,
               std::vector<std::array<int, 3>> offsets, std::vector<double> row);
  /// Empty if the rows are not constant, or differ at walls from the mirror rule.
  static std::optional<ConstantRows> of(const StencilMatrix& matrix, double rounding);

  /// Periodic rows without entries, reusing memory.
  void clear(const std::array<std::int64_t, 3>& cells);
  void add(const std::array<int, 3>& offset, double entry);
  void take_sides(const std::array<Sides, 3>& sides) { sides_ = sides; }

  const std::array<std::int64_t, 3>& cells() const { return cells_; }
  std::int64_t size() const { return cells_[0] * cells_[1] * cells_[2]; }
  const std::array<Sides, 3>& sides() const { return sides_; }
  std::array<bool, 3> periodic() const;
  const std::vector<std::array<int, 3>>& offsets() const { return offsets_; }
  const std::vector<double>& row() const { return row_; }
  double entry(const std::array<int, 3>& offset) const;  // 0 if there is none
  /// The sum of the magnitudes of the entries.
  double row_size() const;
  /// Whether offsets mirrored at these axes have the same entries, up to `zero`.
  bool is_even(const std::array<bool, 3>& mirrored, double zero) const;
  bool operator==(const ConstantRows&) const = default;

  /// The sum of a row away from walls.
  double sum() const { return sum_; }
  /// The same with a diagonal, if there is one, that gives this sum.
  ConstantRows with_sum(double sum) const;
  /// Whether no side has odd symmetry (a wall with a value).
  bool take_constants_to_zero() const;
  ConstantRows transposed() const;
  /// The same with a row for each cell.
  StencilMatrix matrix() const;

  /// Applies the rows of `count` cells along x, from `first` on, to x.
  void multiply_cells(const GridPlace& first, std::int64_t count, std::span<const double> x, double* result) const;
  /// Cell and sign of the mirror image of a position along an axis.
  std::pair<std::int64_t, double> image(std::size_t axis, std::int64_t place) const;
  /// Calls `f`(column, entry) for the entries of a cell's row; columns may repeat.
  template <class F>
  void for_each_entry_of(const GridPlace& cell, const F& f) const {
    for (std::size_t k = 0; k < row_.size(); ++k) {
      GridPlace place{};
      double sign = 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto [along, sign_along] = image(axis, cell[axis] + offsets_[k][axis]);
        place[axis] = along;
        sign *= sign_along;
      }
      f(number_of(cells_, place), sign * row_[k]);
    }
  }
  /// Norm of the largest row, including those next to walls.
  double largest_row() const;

 private:
  std::array<std::int64_t, 3> cells_{1, 1, 1};
  std::array<Sides, 3> sides_{};
  std::vector<std::array<int, 3>> offsets_;
  std::vector<double> row_;
  double sum_ = 0;
};

/// See is_symmetric of StencilMatrix.
bool is_symmetric(const ConstantRows& rows, double rounding);

}  // namespace dpde
