// SPDX-License-Identifier: Apache-2.0
#include "solve/box_probe.h"

#include <algorithm>
#include <utility>

namespace dpde {

BoxProbe::BoxProbe(const LinearImage& image, const BoxShape& shape, std::span<double> from, std::span<double> to,
                   StencilMatrix used)
    : image_(image),
      shape_(shape),
      axes_{AxisColours(shape.cells[0], shape.periodic[0], shape.reach[0]),
            AxisColours(shape.cells[1], shape.periodic[1], shape.reach[1]),
            AxisColours(shape.cells[2], shape.periodic[2], shape.reach[2])},
      from_(from),
      to_(to),
      used_(std::move(used.values)) {
  matrix_.cells = shape.cells;
  matrix_.periodic = shape.periodic;
}

StencilMatrix BoxProbe::all() {
  for_each_cell({axes_[0].count, axes_[1].count, axes_[2].count},
                [&](std::size_t, const GridPlace& colour) { take(colour, true); });
  return std::move(matrix_);
}

std::vector<std::array<int, 3>> BoxProbe::some_offsets() {
  const auto at = [&](std::size_t axis, std::int64_t reaches) {
    return std::clamp<std::int64_t>(reaches * shape_.reach[axis], 0, axes_[axis].count - 1);
  };
  for (const std::int64_t reaches : {1, 0, 2}) take({at(0, reaches), at(1, reaches), at(2, reaches)}, false);
  return std::move(matrix_.offsets);
}

/// The columns of the cells of one colour, or their offsets alone.
void BoxProbe::take(const GridPlace& colour, bool has_values) {
  for_each_cell(shape_.cells, [&](std::size_t number, const GridPlace& cell) {
    bool is_it = true;
    for (std::size_t axis = 0; axis < 3; ++axis)
      is_it = is_it && axes_[axis].colour[static_cast<std::size_t>(cell[axis])] == colour[axis];
    from_[number] = is_it ? 1 : 0;
  });
  image_(from_, to_);
  for_each_cell(shape_.cells, [&](std::size_t number, const GridPlace& cell) {
    if (to_[number] == 0) return;
    std::array<int, 3> offset{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      offset[axis] = axes_[axis].offset(cell[axis], colour[axis]);
      if (offset[axis] == AxisColours::none) return;  // found out by the comparison with arbitrary values
    }
    const std::size_t k = number_of_offset(offset);
    if (has_values) column(k)[number] = to_[number];
  });
}

std::size_t BoxProbe::number_of_offset(const std::array<int, 3>& offset) {
  const auto is_it = [&](const std::array<int, 3>& other) {  // looked for in each cell: == calls memcmp
    return other[0] == offset[0] && other[1] == offset[1] && other[2] == offset[2];
  };
  const auto known = std::ranges::find_if(matrix_.offsets, is_it);
  const auto number = static_cast<std::size_t>(known - matrix_.offsets.begin());
  if (known == matrix_.offsets.end()) matrix_.offsets.push_back(offset);
  return number;
}

std::vector<double>& BoxProbe::column(std::size_t offset) {
  for (std::size_t k = matrix_.values.size(); k <= offset; ++k) {
    std::vector<double> values;
    if (!used_.empty()) {
      values = std::move(used_.back());
      used_.pop_back();
    }
    values.assign(from_.size(), 0.0);
    matrix_.values.push_back(std::move(values));
  }
  return matrix_.values[offset];
}

}  // namespace dpde
