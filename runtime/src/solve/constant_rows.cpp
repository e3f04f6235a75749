// SPDX-License-Identifier: Apache-2.0
#include "solve/constant_rows.h"

#include <algorithm>
#include <cmath>

namespace dpde {
namespace {

double sign_of_low(Sides sides) { return sides == Sides::odd_odd || sides == Sides::odd_even ? -1 : 1; }
double sign_of_high(Sides sides) { return sides == Sides::odd_odd || sides == Sides::even_odd ? -1 : 1; }

/// The cell and the sign of the image of a place along a bounded axis; the place is at most one length outside.
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

/// Whether each row is the one given, with the columns beyond walls added to those of their images.
bool is_made_of(const StencilMatrix& matrix, const std::vector<double>& row, const std::array<Sides, 3>& sides,
                double rounding) {
  double size = 0;
  for (const double value : row) size += std::abs(value);
  const double zero = 64 * rounding * size;
  std::vector<double> expected(row.size());
  std::size_t number = 0;
  for (std::int64_t z = 0; z < matrix.cells[2]; ++z) {
    for (std::int64_t y = 0; y < matrix.cells[1]; ++y) {
      for (std::int64_t x = 0; x < matrix.cells[0]; ++x, ++number) {
        const std::array<std::int64_t, 3> cell{x, y, z};
        std::ranges::fill(expected, 0.0);
        for (std::size_t k = 0; k < row.size(); ++k) {
          std::array<int, 3> offset = matrix.offsets[k];
          double sign = 1;
          for (std::size_t axis = 0; axis < 3; ++axis) {
            if (sides[axis] == Sides::periodic) continue;
            const auto [image, s] = image_of(cell[axis] + offset[axis], matrix.cells[axis], sides[axis]);
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
          if (!(std::abs(expected[k] - matrix.values[k][number]) <= zero)) return false;
        }
      }
    }
  }
  return true;
}

constexpr std::int64_t block = 8;

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
    if (2 * reach >= matrix.cells[axis] || !dpde::is_even(matrix.offsets, row, mirrored, 64 * rounding * size))
      return std::nullopt;
  }
  for (int choice = 0; choice < 1 << bounded; ++choice) {
    int bits = choice;
    for (Sides& each : sides) {
      if (each == Sides::periodic) continue;
      each = std::array{Sides::even_even, Sides::odd_even, Sides::even_odd, Sides::odd_odd}[bits & 3];
      bits >>= 2;
    }
    if (is_made_of(matrix, row, sides, rounding)) return ConstantRows(matrix, row, sides);
  }
  return std::nullopt;
}

ConstantRows::ConstantRows(const StencilMatrix& matrix, const std::vector<double>& row,
                           const std::array<Sides, 3>& sides)
    : cells_(matrix.cells), sides_(sides), offsets_(matrix.offsets), row_(row), lines_(row.size()) {
  for (const auto& offset : offsets_) reach_ = std::max<std::int64_t>(reach_, std::abs(offset[0]));
  reach_ = std::min(reach_, cells_[0]);
}

bool ConstantRows::is_even(const std::array<bool, 3>& mirrored, double zero) const {
  return dpde::is_even(offsets_, row_, mirrored, zero);
}

/// The cell and the sign of the image of a place along an axis.
std::pair<std::int64_t, double> ConstantRows::image(std::size_t axis, std::int64_t place) const {
  const std::int64_t n = cells_[axis];
  if (sides_[axis] == Sides::periodic) return {(place % n + n) % n, 1};
  return image_of(place, n, sides_[axis]);
}

double ConstantRows::left_of_cell(double b, std::int64_t x) const {
  for (const Line& line : lines_) {
    const auto [cell, sign] = image(0, x + line.shift);
    b -= sign * line.factor * line.values[cell];
  }
  return b;
}

/// Away from its ends several cells at once.
double ConstantRows::squared_left_of_line(const double* b) const {
  const std::int64_t n = cells_[0];
  double sum = 0;
  const auto add = [&](std::int64_t x) {
    const double left = left_of_cell(b[x], x);
    sum += left * left;
  };
  std::int64_t x = 0;
  for (; x < reach_; ++x) add(x);
  std::array<double, block> sums{};
  for (; x + block <= n - reach_; x += block) {
    std::array<double, block> left;
    for (std::size_t i = 0; i < block; ++i) left[i] = b[x + static_cast<std::int64_t>(i)];
    for (const Line& line : lines_) {
      const double* const values = line.values + x + line.shift;
      for (std::size_t i = 0; i < block; ++i) left[i] -= line.factor * values[i];
    }
    for (std::size_t i = 0; i < block; ++i) sums[i] += left[i] * left[i];
  }
  for (; x < n; ++x) add(x);
  for (const double part : sums) sum += part;
  return sum;
}

double ConstantRows::residual(std::span<const double> b, std::span<const double> x) {
  double sum = 0;
  for (std::int64_t z = 0; z < cells_[2]; ++z) {
    for (std::int64_t y = 0; y < cells_[1]; ++y) {
      for (std::size_t k = 0; k < row_.size(); ++k) {
        const auto [cell_y, sign_y] = image(1, y + offsets_[k][1]);
        const auto [cell_z, sign_z] = image(2, z + offsets_[k][2]);
        lines_[k] = {x.data() + cells_[0] * (cell_y + cells_[1] * cell_z), row_[k] * sign_y * sign_z, offsets_[k][0]};
      }
      sum += squared_left_of_line(b.data() + cells_[0] * (y + cells_[1] * z));
    }
  }
  return std::sqrt(sum);
}

}  // namespace dpde
