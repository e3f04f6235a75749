// SPDX-License-Identifier: Apache-2.0
#include "solve/multigrid/axis_colours.h"

namespace dpde {

AxisColours::AxisColours(std::int64_t cells, bool periodic, std::int64_t reach)
    : count(cells), colour(static_cast<std::size_t>(cells)) {
  const std::int64_t period = 2 * reach + 1;
  const bool has_room = reach >= 0 && cells > period;
  const std::int64_t whole = !has_room ? 0 : periodic ? cells / period * period : cells;
  if (has_room) count = period + cells - whole;
  for (std::int64_t i = 0; i < cells; ++i)
    colour[static_cast<std::size_t>(i)] = has_room && i < whole ? i % period : i - whole + (has_room ? period : 0);
  offsets.assign(static_cast<std::size_t>(cells * count), none);
  const std::int64_t farthest = has_room ? reach : cells - 1;
  for (std::int64_t i = 0; i < cells; ++i) {
    for (std::int64_t step = 0; step <= 2 * farthest; ++step) {  // 0, 1, -1, 2, -2, ...
      const std::int64_t offset = step % 2 == 0 ? -step / 2 : (step + 1) / 2;
      std::int64_t j = i + offset;
      if (periodic) j = ((j % cells) + cells) % cells;
      if (j < 0 || j >= cells) continue;
      int& known = offsets[static_cast<std::size_t>(i * count + colour[static_cast<std::size_t>(j)])];
      if (known == none) known = static_cast<int>(offset);
    }
  }
}

}  // namespace dpde
