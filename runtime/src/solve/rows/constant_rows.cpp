// SPDX-License-Identifier: Apache-2.0
#include "solve/rows/constant_rows.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "solve/rows/row_kernels.h"

namespace dpde {
namespace {

double sign_of_low(Sides sides) { return sides == Sides::odd_odd || sides == Sides::odd_even ? -1 : 1; }
double sign_of_high(Sides sides) { return sides == Sides::odd_odd || sides == Sides::even_odd ? -1 : 1; }

/// Cell and sign of the mirror image of a position on a bounded axis, at most one length outside.
std::pair<std::int64_t, double> image_of(std::int64_t place, std::int64_t cells, Sides sides) {
  if (place < 0) return {-1 - place, sign_of_low(sides)};
  if (place >= cells) return {2 * cells - 1 - place, sign_of_high(sides)};
  return {place, 1};
}

/// Whether mirrored offsets have the same entries; `mirrored`: the axes.
bool is_even(const std::vector<std::array<int, 3>>& offsets, const std::vector<double>& row,
             const std::array<bool, 3>& mirrored, double zero) {
  for (std::size_t k = 0; k < row.size(); ++k) {
    std::array<int, 3> image = offsets[k];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (mirrored[axis]) image[axis] = -image[axis];
    }
    const auto other = std::ranges::find(offsets, image);
    const double value = other == offsets.end() ? 0 : row[static_cast<std::size_t>(other - offsets.begin())];
    if (std::abs(value - row[k]) > zero) return false;
  }
  return true;
}

/// Whether each row is the given one, with columns beyond walls added to those of their mirror cells, whose sums may be
/// rounded in another order.
bool is_made_of(const StencilMatrix& matrix, const std::vector<double>& row, const std::array<Sides, 3>& sides,
                double rounding) {
  double size = 0;
  for (const double value : row) size += std::abs(value);
  const double zero = 64 * rounding * size, inside = difference_of_same_rows * size;
  std::vector<double> expected(row.size());
  std::size_t number = 0;
  for (std::int64_t z = 0; z < matrix.cells[2]; ++z) {
    for (std::int64_t y = 0; y < matrix.cells[1]; ++y) {
      for (std::int64_t x = 0; x < matrix.cells[0]; ++x, ++number) {
        const std::array<std::int64_t, 3> cell{x, y, z};
        std::ranges::fill(expected, 0.0);
        bool has_images = false;
        for (std::size_t k = 0; k < row.size(); ++k) {
          std::array<int, 3> offset = matrix.offsets[k];
          double sign = 1;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            if (sides[axis] == Sides::periodic) continue;
            const std::int64_t place = cell[axis] + offset[axis];
            const auto [image, s] = image_of(place, matrix.cells[axis], sides[axis]);
            has_images = has_images || image != place;
            offset[axis] = static_cast<int>(image - cell[axis]);
            sign *= s;
          }
          const auto known = std::ranges::find(matrix.offsets, offset);
          if (known == matrix.offsets.end()) {
            if (std::abs(row[k]) > zero) return false;
            continue;
          }
          expected[static_cast<std::size_t>(known - matrix.offsets.begin())] += sign * row[k];
        }
        for (std::size_t k = 0; k < row.size(); ++k) {
          if (!(std::abs(expected[k] - matrix.values[k][number]) <= (has_images ? zero : inside))) return false;
        }
      }
    }
  }
  return true;
}

}  // namespace

std::optional<ConstantRows> ConstantRows::of(const StencilMatrix& matrix, double rounding) {
  if (matrix.offsets.empty()) return std::nullopt;
  const std::int64_t middle =
      matrix.cells[0] / 2 + matrix.cells[0] * (matrix.cells[1] / 2 + matrix.cells[1] * (matrix.cells[2] / 2));
  std::vector<double> row;
  double size = 0;
  for (const std::vector<double>& column : matrix.values) {
    row.push_back(column[static_cast<std::size_t>(middle)]);
    size += std::abs(row.back());
  }
  std::array<Sides, 3> sides{};
  int bounded = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (matrix.periodic[axis] || matrix.cells[axis] == 1) continue;
    sides[axis] = Sides::even_even;
    bounded += 2;
    std::array<bool, 3> mirrored{};
    mirrored[axis] = true;
    int reach = 0;
    for (const auto& offset : matrix.offsets) reach = std::max(reach, std::abs(offset[axis]));
    const double zero = difference_of_same_rows * size;
    if (2 * reach >= matrix.cells[axis] || !dpde::is_even(matrix.offsets, row, mirrored, zero)) return std::nullopt;
  }
  for (int choice = 0; choice < 1 << bounded; ++choice) {
    int bits = choice;
    for (Sides& each : sides) {
      if (each == Sides::periodic) continue;
      each = std::array{Sides::even_even, Sides::odd_even, Sides::even_odd, Sides::odd_odd}[bits & 3];
      bits >>= 2;
    }
    if (is_made_of(matrix, row, sides, rounding)) return ConstantRows(matrix.cells, sides, matrix.offsets, row);
  }
  return std::nullopt;
}

ConstantRows::ConstantRows(const std::array<std::int64_t, 3>& cells, const std::array<Sides, 3>& sides,
                           std::vector<std::array<int, 3>> offsets, std::vector<double> row)
    : cells_(cells),
      sides_(sides),
      offsets_(std::move(offsets)),
      row_(std::move(row)),
      sum_(std::accumulate(row_.begin(), row_.end(), 0.0)) {}

void ConstantRows::clear(const std::array<std::int64_t, 3>& cells) {
  cells_ = cells;
  sides_ = {};
  offsets_.clear();
  row_.clear();
  sum_ = 0;
}

void ConstantRows::add(const std::array<int, 3>& offset, double entry) {
  offsets_.push_back(offset);
  row_.push_back(entry);
  sum_ += entry;
}

std::array<bool, 3> ConstantRows::periodic() const {
  std::array<bool, 3> result{};
  for (std::size_t axis = 0; axis < 3; ++axis) result[axis] = sides_[axis] == Sides::periodic;
  return result;
}

double ConstantRows::entry(const std::array<int, 3>& offset) const {
  const auto found = std::ranges::find(offsets_, offset);
  return found == offsets_.end() ? 0 : row_[static_cast<std::size_t>(found - offsets_.begin())];
}

double ConstantRows::row_size() const {
  double size = 0;
  for (const double value : row_) size += std::abs(value);
  return size;
}

bool ConstantRows::is_even(const std::array<bool, 3>& mirrored, double zero) const {
  return dpde::is_even(offsets_, row_, mirrored, zero);
}

/// Stores the sum: the sum of the entries has the rounding (f64) of the largest one.
ConstantRows ConstantRows::with_sum(double sum) const {
  ConstantRows result = *this;
  result.sum_ = sum;
  const auto middle = std::ranges::find(offsets_, std::array{0, 0, 0});
  if (middle != offsets_.end()) {
    const double before = std::accumulate(row_.begin(), row_.end(), 0.0);
    result.row_[static_cast<std::size_t>(middle - offsets_.begin())] += sum - before;
  }
  return result;
}

bool ConstantRows::take_constants_to_zero() const {
  return sum_ == 0 && std::ranges::none_of(
                          sides_, [](Sides sides) { return sides != Sides::periodic && sides != Sides::even_even; });
}

bool is_symmetric(const ConstantRows& rows, double rounding) {
  for (std::size_t k = 0; k < rows.row().size(); ++k) {
    std::array<int, 3> back = rows.offsets()[k];
    for (int& along : back) along = -along;
    if (!are_same(rows.row()[k], rows.entry(back), rounding)) return false;
  }
  return true;
}

/// Along bounded axes rows are even, and remain symmetric with mirror cells.
ConstantRows ConstantRows::transposed() const {
  ConstantRows result = *this;
  for (auto& offset : result.offsets_) {
    for (int& along : offset) along = -along;
  }
  return result;
}

StencilMatrix ConstantRows::matrix() const {
  StencilMatrix matrix{cells_, periodic(), offsets_, {}};
  const auto size = static_cast<std::size_t>(this->size());
  matrix.values.assign(offsets_.size(), std::vector<double>(size, 0.0));
  const auto column_of_offset = [&](const std::array<int, 3>& offset) -> std::vector<double>& {
    const auto known = std::ranges::find(matrix.offsets, offset);
    if (known != matrix.offsets.end()) return matrix.values[static_cast<std::size_t>(known - matrix.offsets.begin())];
    matrix.offsets.push_back(offset);
    return matrix.values.emplace_back(size, 0.0);
  };
  for_each_cell(cells_, [&](std::size_t number, const GridPlace& cell) {
    for (std::size_t k = 0; k < row_.size(); ++k) {
      std::array<int, 3> offset = offsets_[k];
      double sign = 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (sides_[axis] == Sides::periodic) continue;
        const auto [along, sign_along] = image(axis, cell[axis] + offset[axis]);
        offset[axis] = static_cast<int>(along - cell[axis]);
        sign *= sign_along;
      }
      (offset == offsets_[k] ? matrix.values[k] : column_of_offset(offset))[number] += sign * row_[k];
    }
  });
  return matrix;
}

std::pair<std::int64_t, double> ConstantRows::image(std::size_t axis, std::int64_t place) const {
  const std::int64_t n = cells_[axis];
  if (place >= 0 && place < n) return {place, 1};
  if (sides_[axis] == Sides::periodic) return {(place % n + n) % n, 1};
  return image_of(place, n, sides_[axis]);
}

/// Cells away from the ends of a line are done in one loop.
void ConstantRows::multiply_cells(const GridPlace& first, std::int64_t count, std::span<const double> x,
                                  double* result) const {
  constexpr int most = 16;  // terms in one loop
  std::int64_t begin = 0, end = count;
  for (const std::array<int, 3>& offset : offsets_) {
    begin = std::max<std::int64_t>(begin, -first[0] - offset[0]);
    end = std::min<std::int64_t>(end, cells_[0] - first[0] - offset[0]);
  }
  begin = std::min(begin, count);
  end = std::max(begin, end);
  std::fill_n(result, count, 0.0);
  const auto& kernels = row_kernels().of<double>();
  RowSum<double> sum{.count = end - begin};
  const auto add_term = [&](const double* values, double weight) {
    sum.values[sum.terms] = values;
    sum.weights[sum.terms++] = weight;
  };
  for (std::size_t k = 0; k < row_.size(); ++k) {
    const auto [y, sign_y] = image(1, first[1] + offsets_[k][1]);
    const auto [z, sign_z] = image(2, first[2] + offsets_[k][2]);
    const double* const line = x.data() + number_of(cells_, {0, y, z});
    const double factor = row_[k] * sign_y * sign_z;
    const std::int64_t shift = first[0] + offsets_[k][0];
    const auto add = [&](std::int64_t i) {
      const auto [cell, sign] = image(0, i + shift);
      result[i] += sign * factor * line[cell];
    };
    for (std::int64_t i = 0; i < begin; ++i) add(i);
    for (std::int64_t i = end; i < count; ++i) add(i);
    if (sum.terms == most) {
      kernels.sum(sum, result + begin);
      sum.terms = 0;
      add_term(result + begin, 1);
    }
    add_term(line + shift + begin, factor);
  }
  kernels.sum(sum, result + begin);
}

/// Largest over cells next to walls, and one between them.
double ConstantRows::largest_row() const {
  std::array<std::vector<std::int64_t>, 3> places;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int64_t reach = 0;
    for (const auto& offset : offsets_) reach = std::max<std::int64_t>(reach, std::abs(offset[axis]));
    for (std::int64_t i = 0; i < cells_[axis]; ++i) {
      const bool is_beside_wall = sides_[axis] != Sides::periodic && (i < reach || i >= cells_[axis] - reach);
      if (is_beside_wall || i == cells_[axis] / 2) places[axis].push_back(i);
    }
  }
  double most = 0;
  std::vector<std::pair<std::size_t, double>> entries;
  for (const std::int64_t z : places[2]) {
    for (const std::int64_t y : places[1]) {
      for (const std::int64_t x : places[0]) {
        entries.clear();
        for_each_entry_of({x, y, z}, [&](std::size_t column, double value) {
          const auto known = std::ranges::find(entries, column, &std::pair<std::size_t, double>::first);
          if (known == entries.end()) {
            entries.emplace_back(column, value);
          } else {
            known->second += value;
          }
        });
        double squares = 0;
        for (const auto& [column, value] : entries) squares += value * value;
        most = std::max(most, std::sqrt(squares));
      }
    }
  }
  return most;
}

}  // namespace dpde
