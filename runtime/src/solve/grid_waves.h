// SPDX-License-Identifier: Apache-2.0
// Multiplies the waves of a field on a grid, in one thread: axis after axis there and back, the last one in blocks of
// columns that stay in the cache between there and back.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "solve/line_waves.h"

namespace dpde {

class GridWaves {
 public:
  GridWaves(const std::array<std::int64_t, 3>& cells, const std::array<Sides, 3>& sides);

  /// Of factors: doubles, two side by side for each wave where waves are complex, with gaps between rows. Two waves of
  /// periodic axes are one, the other being its conjugate.
  std::int64_t size() const { return rows_ * row_; }
  bool are_complex() const { return are_complex_; }
  /// What there and back multiplies by.
  double scale() const { return scale_; }
  /// `f`(where its factor begins, by which angle it turns from cell to cell along each axis, as turns of 2*pi/period).
  void for_each(const std::function<void(std::size_t place, const std::array<std::int64_t, 3>& turns)>& f) const;
  std::int64_t period(std::size_t axis) const;

  /// Nothing is allocated. `have_phases`: complex factors; otherwise each double is multiplied by the one in its place.
  /// Arrays are aligned as `new` aligns them.
  void multiply(std::span<const double> field, const double* factors, bool have_phases, std::span<double> product);

 private:
  /// An axis behind the first, of arrays with rows of `inner` doubles side by side.
  struct Stage {
    std::size_t axis;
    LineWaves lines;
    std::int64_t outer, inner;
    double *from, *to;
  };

  void make_first(std::size_t axis, std::int64_t cells, Sides sides);
  void make_stage(std::size_t axis, std::int64_t cells, Sides sides, bool is_last);
  void first_forward(const double* field);
  void first_backward(double* product);
  static void forward(Stage& stage);
  static void backward(Stage& stage);
  void multiply_last(Stage& stage, const double* factors, bool have_phases) const;
  void multiply_line(const double* field, const double* factors, bool have_phases, double* product);

  std::array<std::int64_t, 3> cells_, modes_{1, 1, 1};
  std::size_t first_axis_ = 0;
  std::int64_t lines_ = 1, first_row_ = 0;  // along the first axis; doubles of a row of its waves with the gap
  std::optional<RealFft> ring_;             // the first axis is periodic
  std::optional<LineWaves> images_;         // or bounded
  std::vector<Stage> stages_;
  std::int64_t row_ = 0, rows_ = 1;  // doubles of a row of waves with its gap; rows of all waves
  bool are_complex_ = false;
  double scale_ = 1;
  AlignedValues first_, second_;  // waves along the first axis; those behind an axis where real ones become complex
};

}  // namespace dpde
