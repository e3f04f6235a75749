// SPDX-License-Identifier: Apache-2.0
// Colours of the cells along one axis: those of one colour are more than twice the reach apart, around the end of a
// periodic axis too, so that an image looks at one of them at most (Curtis, Powell and Reid 1974).
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

namespace dpde {

struct AxisColours {
  static constexpr int none = std::numeric_limits<int>::min();

  /// `reach`: how far from a cell its image looks, -1: anywhere.
  AxisColours(std::int64_t cells, bool periodic, std::int64_t reach);
  /// To the cell of that colour that the image in cell i may depend on.
  int offset(std::int64_t i, std::int64_t of_colour) const {
    return offsets[static_cast<std::size_t>(i * count + of_colour)];
  }

  std::int64_t count;
  std::vector<std::int64_t> colour;
  std::vector<int> offsets;
};

}  // namespace dpde
