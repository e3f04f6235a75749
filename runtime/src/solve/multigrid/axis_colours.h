// SPDX-License-Identifier: Apache-2.0
// Colours of the cells along one axis. Cells of one colour are more than twice the stencil radius apart, also across a
// periodic end, so that a row of the operator reads at most one of them (Curtis, Powell and Reid 1974).
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

namespace dpde {

struct AxisColours {
  static constexpr int none = std::numeric_limits<int>::min();

  /// `reach`: stencil radius; -1: the whole axis.
  AxisColours(std::int64_t cells, bool periodic, std::int64_t reach);
  /// Offset from cell i to the cell of that colour within its stencil.
  int offset(std::int64_t i, std::int64_t of_colour) const {
    return offsets[static_cast<std::size_t>(i * count + of_colour)];
  }

  std::int64_t count;
  std::vector<std::int64_t> colour;
  std::vector<int> offsets;
};

}  // namespace dpde
