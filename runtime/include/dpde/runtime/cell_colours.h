// SPDX-License-Identifier: Apache-2.0
// Colouring of the cells by which the matrix of an operator is found: cells of one colour are so far apart that no row
// of the matrix has two of them, so that one application of the operator gives all their columns (Curtis, Powell and
// Reid 1974).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace dpde {

struct CellColour {
  std::vector<std::int64_t> cells;    // cells of this colour
  std::vector<std::int64_t> sources;  // for each cell of the grid: the cell of this colour within its stencil, or -1
};

/// `reach`: stencil radius along each axis; -1: the whole axis. Cells are numbered with x fastest.
std::vector<CellColour> cell_colours(const std::array<std::int64_t, 3>& cells, const std::array<bool, 3>& periodic,
                                     const std::array<std::int64_t, 3>& reach);

}  // namespace dpde
