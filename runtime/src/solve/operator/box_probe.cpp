// SPDX-License-Identifier: Apache-2.0
#include "solve/operator/box_probe.h"

#include <algorithm>
#include <utility>

namespace dpde {

BoxProbe::BoxProbe(const LinearImage& image, const BoxShape& shape, const std::array<AxisColours, 3>& axes,
                   std::span<double> from, std::span<double> to, StencilMatrix used)
    : image_(image), shape_(shape), axes_(axes), from_(from), to_(to), matrix_(std::move(used)) {
  matrix_.cells = shape.cells;
  matrix_.periodic = shape.periodic;
  matrix_.offsets.clear();
}

StencilMatrix BoxProbe::all() {
  for_each_cell({axes_[0].count, axes_[1].count, axes_[2].count},
                [&](std::size_t, const GridPlace& colour) { take(colour, true); });
  matrix_.values.resize(columns_);
  return std::move(matrix_);
}

std::vector<std::array<int, 3>> BoxProbe::some_offsets(std::vector<std::array<int, 3>> used) {
  matrix_.offsets = std::move(used);
  matrix_.offsets.clear();
  const auto at = [&](std::size_t axis, std::int64_t reaches) {
    return std::clamp<std::int64_t>(reaches * shape_.reach[axis], 0, axes_[axis].count - 1);
  };
  for (const std::int64_t reaches : {1, 0, 2}) take({at(0, reaches), at(1, reaches), at(2, reaches)}, false);
  return std::move(matrix_.offsets);
}

/// Reads the columns of the cells of one colour, or only their offsets. Row by row, since each axis has its own
/// colours.
void BoxProbe::take(const GridPlace& colour, bool has_values) {
  const auto n = static_cast<std::size_t>(shape_.cells[0]);
  const GridPlace rows{1, shape_.cells[1], shape_.cells[2]};
  const auto has_colour = [&](std::size_t axis, std::size_t i) { return axes_[axis].colour[i] == colour[axis]; };
  for_each_cell(rows, [&](std::size_t row, const GridPlace& cell) {
    double* const from = from_.data() + row * n;
    const bool is_it =
        has_colour(1, static_cast<std::size_t>(cell[1])) && has_colour(2, static_cast<std::size_t>(cell[2]));
    for (std::size_t x = 0; x < n; ++x) from[x] = is_it && has_colour(0, x) ? 1 : 0;
  });
  image_(from_, to_);
  for_each_cell(rows, [&](std::size_t row, const GridPlace& cell) {
    std::array<int, 3> offset{0, axes_[1].offset(cell[1], colour[1]), axes_[2].offset(cell[2], colour[2])};
    if (offset[1] == AxisColours::none || offset[2] == AxisColours::none) return;
    for (std::size_t x = 0, number = row * n; x < n; ++x, ++number) {
      if (to_[number] == 0) continue;
      offset[0] = axes_[0].offset(static_cast<std::int64_t>(x), colour[0]);
      if (offset[0] == AxisColours::none) continue;  // the comparison with arbitrary values would find an entry
      const std::size_t k = number_of_offset(offset);
      if (has_values) column(k)[number] = to_[number];
    }
  });
}

std::size_t BoxProbe::number_of_offset(const std::array<int, 3>& offset) {
  const auto is_it = [&](const std::array<int, 3>& other) {  // for each cell: == would call memcmp
    return other[0] == offset[0] && other[1] == offset[1] && other[2] == offset[2];
  };
  const auto known = std::ranges::find_if(matrix_.offsets, is_it);
  const auto number = static_cast<std::size_t>(known - matrix_.offsets.begin());
  if (known == matrix_.offsets.end()) matrix_.offsets.push_back(offset);
  return number;
}

std::vector<double>& BoxProbe::column(std::size_t offset) {
  for (; columns_ <= offset; ++columns_) {
    if (columns_ == matrix_.values.size()) matrix_.values.emplace_back();
    matrix_.values[columns_].assign(from_.size(), 0.0);
  }
  return matrix_.values[offset];
}

}  // namespace dpde
