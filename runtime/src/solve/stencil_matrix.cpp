// SPDX-License-Identifier: Apache-2.0
#include "solve/stencil_matrix.h"

#include <algorithm>

namespace dpde {

std::int64_t column_of(const StencilMatrix& matrix, std::array<std::int64_t, 3> cell,
                       const std::array<int, 3>& offset) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cell[axis] = place_along(matrix, axis, cell[axis] + offset[axis]);
    if (cell[axis] < 0) return -1;
  }
  return cell[0] + matrix.cells[0] * (cell[1] + matrix.cells[1] * cell[2]);
}

StencilMatrix transposed(const StencilMatrix& matrix) {
  StencilMatrix result{matrix.cells, matrix.periodic, matrix.offsets, {}};
  result.values.assign(matrix.values.size(), std::vector<double>(static_cast<std::size_t>(matrix.size()), 0.0));
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    for (int& o : result.offsets[k]) o = -o;
    const StencilMatrix one{matrix.cells, matrix.periodic, {matrix.offsets[k]}, {matrix.values[k]}};
    for_each_entry(one, [&](std::size_t row, std::size_t column, double value) {
      (void)row;
      result.values[k][column] = value;
    });
  }
  return result;
}

void multiply(const StencilMatrix& matrix, std::span<const double> x, std::span<double> result) {
  std::ranges::fill(result, 0.0);
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) { result[row] += value * x[column]; });
}

}  // namespace dpde
