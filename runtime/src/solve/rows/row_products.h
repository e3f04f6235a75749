// SPDX-License-Identifier: Apache-2.0
// Residuals for both kinds of rows; nothing is allocated.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "solve/matrix/stencil_matrix.h"
#include "solve/rows/constant_rows.h"

namespace dpde {

inline const std::array<std::int64_t, 3>& grid_of(const ConstantRows& rows) { return rows.cells(); }
inline const std::array<std::int64_t, 3>& grid_of(const StencilMatrix& matrix) { return matrix.cells; }
inline void multiply_cells(const ConstantRows& rows, const GridPlace& first, std::int64_t count,
                           std::span<const double> x, double* result) {
  rows.multiply_cells(first, count, x, result);
}

/// Calls `f`(b - A*x) for each cell of the rows `begin` to `end` along x.
template <class Rows, class F>
void for_each_left(const Rows& rows, std::size_t begin, std::size_t end, std::span<const double> b,
                   std::span<const double> x, const F& f) {
  std::array<double, cells_of_block> image;
  for_each_block_of(grid_of(rows), begin, end, [&](std::size_t number, const GridPlace& first, std::int64_t count) {
    multiply_cells(rows, first, count, x, image.data());
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) f(b[number + i] - image[i]);
  });
}

/// Largest magnitude in b - A*x; NaN if one is NaN.
template <class Rows>
double largest_residual(const Rows& rows, std::span<const double> b, std::span<const double> x) {
  double most = 0;
  const auto count = static_cast<std::size_t>(grid_of(rows)[1] * grid_of(rows)[2]);
  for_each_left(rows, 0, count, b, x,
                [&](double left) { most = std::isnan(left) ? left : std::max(most, std::abs(left)); });
  return most;
}

}  // namespace dpde
