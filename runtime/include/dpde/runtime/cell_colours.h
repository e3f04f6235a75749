// SPDX-License-Identifier: Apache-2.0
// Cells that can be disturbed at once to find the matrix of an operator: so far from one another that no image looks at
// two of them (Curtis, Powell and Reid 1974).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace dpde {

struct CellColour {
  std::vector<std::int64_t> cells;    // those that have it
  std::vector<std::int64_t> sources;  // for each cell of the grid: the one of them that its image may look at, or -1
};

/// `reach`: how far from a cell its image looks, -1: anywhere. x fastest.
std::vector<CellColour> cell_colours(const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic,
                                     const std::array<std::int64_t, 3>& reach);

}  // namespace dpde
