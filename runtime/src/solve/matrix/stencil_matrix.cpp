// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/stencil_matrix.h"

#include <algorithm>
#include <cmath>

#include "solve/rows/row_kernels.h"

namespace dpde {

std::int64_t column_of(const StencilMatrix& matrix, std::array<std::int64_t, 3> cell,
                       const std::array<int, 3>& offset) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    cell[axis] = place_along(matrix, axis, cell[axis] + offset[axis]);
    if (cell[axis] < 0) return -1;
  }
  return cell[0] + matrix.cells[0] * (cell[1] + matrix.cells[1] * cell[2]);
}

namespace {

/// Calls `f`(begin, end, shift) for the runs in first <= x < end along x whose entry is in column x + shift.
template <class F>
void for_each_run(const StencilMatrix& matrix, std::int64_t offset, std::int64_t first, std::int64_t end, const F& f) {
  const std::int64_t n = matrix.cells[0];
  const auto run = [&](std::int64_t from, std::int64_t to, std::int64_t shift) {
    const std::int64_t begin = std::max(from, first), behind = std::min(to, end);
    if (begin < behind) f(begin, behind, shift);
  };
  if (!matrix.periodic[0]) return run(-offset, n - offset, offset);
  const std::int64_t shift = (offset % n + n) % n;
  run(0, n - shift, shift);
  run(n - shift, n, shift - n);
}

/// The offsets that give the same column as offset `of`, or as its opposite.
std::vector<std::size_t> same_column(const StencilMatrix& matrix, std::size_t of, int sign) {
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    bool is_it = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int apart = matrix.offsets[k][axis] - sign * matrix.offsets[of][axis];
      is_it = is_it && (matrix.periodic[axis] ? apart % matrix.cells[axis] == 0 : apart == 0);
    }
    if (is_it) found.push_back(k);
  }
  return found;
}

double sum_of(const StencilMatrix& matrix, const std::vector<std::size_t>& offsets, std::size_t row) {
  double sum = 0;
  for (const std::size_t k : offsets) sum += matrix.values[k][row];
  return sum;
}

}  // namespace

/// If all columns are at their regular offsets the products are one loop; ends are done column by column.
void multiply_cells(const StencilMatrix& matrix, const GridPlace& first, std::int64_t count, std::span<const double> x,
                    double* result) {
  const auto line = static_cast<std::int64_t>(number_of(matrix.cells, {0, first[1], first[2]}));
  std::int64_t begin = first[0], end = first[0] + count;
  for (const std::array<int, 3>& offset : matrix.offsets) {
    begin = std::max<std::int64_t>(begin, -offset[0]);
    end = std::min<std::int64_t>(end, matrix.cells[0] - offset[0]);
  }
  begin = std::min(begin, first[0] + count);
  end = std::max(begin, end);
  std::fill_n(result, count, 0.0);
  const RowKernels& kernels = row_kernels();
  RowProducts products{.count = end - begin, .is_added = true};
  const auto add_products = [&] {
    kernels.add_products(products, result + (begin - first[0]));
    products.terms = 0;
  };
  for (std::size_t k = 0; k < matrix.offsets.size(); ++k) {
    const std::array<int, 3>& offset = matrix.offsets[k];
    const std::int64_t y = place_along(matrix, 1, first[1] + offset[1]),
                       z = place_along(matrix, 2, first[2] + offset[2]);
    if (y < 0 || z < 0) continue;
    const double* const from = x.data() + number_of(matrix.cells, {0, y, z});
    const double* const values = matrix.values[k].data() + line;
    const auto add = [&](std::int64_t from_begin, std::int64_t to_end, std::int64_t shift) {
      for (std::int64_t i = from_begin; i < to_end; ++i) result[i - first[0]] += values[i] * from[i + shift];
    };
    for_each_run(matrix, offset[0], first[0], begin, add);
    for_each_run(matrix, offset[0], end, first[0] + count, add);
    products.values[products.terms] = values + begin;
    products.x[products.terms++] = from + begin + offset[0];
    if (products.terms == RowProducts::most) add_products();
  }
  add_products();
}

void multiply(const StencilMatrix& matrix, std::span<const double> x, std::span<double> result) {
  for_each_block(matrix.cells, [&](std::size_t number, const GridPlace& first, std::int64_t count) {
    multiply_cells(matrix, first, count, x, result.data() + number);
  });
}

void multiply_transposed(const StencilMatrix& matrix, std::span<const double> x, std::span<double> result) {
  std::ranges::fill(result, 0.0);
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) { result[column] += value * x[row]; });
}

namespace {

/// On all but small periodic axes each offset is a separate column.
bool is_column_each(const StencilMatrix& matrix) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const std::array<int, 3>& offset : matrix.offsets) {
      if (matrix.periodic[axis] && 2 * std::abs(offset[axis]) >= matrix.cells[axis]) return false;
    }
  }
  return true;
}

}  // namespace

bool is_symmetric(const StencilMatrix& matrix, double rounding) {
  const bool is_one = is_column_each(matrix);
  bool are_all = true;
  for (std::size_t k = 0; k < matrix.offsets.size() && are_all; ++k) {
    if (!is_one && same_column(matrix, k, 1).front() != k) continue;
    const std::array<int, 3>& offset = matrix.offsets[k];
    const auto opposite = std::ranges::find(matrix.offsets, std::array{-offset[0], -offset[1], -offset[2]});
    const double* const back = opposite == matrix.offsets.end()
                                   ? nullptr
                                   : matrix.values[static_cast<std::size_t>(opposite - matrix.offsets.begin())].data();
    const double* const forth = matrix.values[k].data();
    const std::vector<std::size_t> none, same = is_one ? none : same_column(matrix, k, 1),
                                         other = is_one ? none : same_column(matrix, k, -1);
    for_each_cell(matrix.cells, [&](std::size_t row, const GridPlace& cell) {
      const std::int64_t column = column_of(matrix, cell, offset);
      if (column < 0) return;
      const auto there = static_cast<std::size_t>(column);
      are_all = are_all && (is_one ? are_same(forth[row], back == nullptr ? 0 : back[there], rounding)
                                   : are_same(sum_of(matrix, same, row), sum_of(matrix, other, there), rounding));
    });
  }
  return are_all;
}

}  // namespace dpde
