// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/cell_colours.h"

#include "solve/fourier/grid_place.h"
#include "solve/multigrid/axis_colours.h"

namespace dpde {

std::vector<CellColour> cell_colours(const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic,
                                     const std::array<std::int64_t, 3>& reach) {
  const std::array<AxisColours, 3> axes{AxisColours(cells[0], periodic[0], reach[0]),
                                        AxisColours(cells[1], periodic[1], reach[1]),
                                        AxisColours(cells[2], periodic[2], reach[2])};
  std::vector<CellColour> colours;
  for_each_cell({axes[0].count, axes[1].count, axes[2].count}, [&](std::size_t, const GridPlace& of_axes) {
    CellColour& colour = colours.emplace_back();
    for_each_cell(cells, [&](std::size_t number, const GridPlace& cell) {
      GridPlace source = cell;
      bool has_colour = true, is_there = true;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        has_colour = has_colour && axes[axis].colour[static_cast<std::size_t>(cell[axis])] == of_axes[axis];
        const int offset = axes[axis].offset(cell[axis], of_axes[axis]);
        is_there = is_there && offset != AxisColours::none;
        if (!is_there) break;
        source[axis] += offset;
        if (periodic[axis]) source[axis] = ((source[axis] % cells[axis]) + cells[axis]) % cells[axis];
      }
      colour.sources.push_back(is_there ? static_cast<std::int64_t>(number_of(cells, source)) : -1);
      if (has_colour) colour.cells.push_back(static_cast<std::int64_t>(number));
    });
  });
  return colours;
}

}  // namespace dpde
