// SPDX-License-Identifier: Apache-2.0
// Divides the rows of a grid among threads. Inside the runtime only.
#pragma once

#include <cstdint>

#include "dpde/runtime/team.h"

namespace dpde {

/// Calls `f(y, z)` for each of the ny*nz rows, in memory order within each of `parts` equal parts.
template <class F>
void share_rows(const Team& team, int64_t parts, int64_t ny, int64_t nz, const F& f) {
  team.run(parts, [&](int64_t part, int) {
    const int64_t from = ny * nz * part / parts, to = ny * nz * (part + 1) / parts;
    int64_t y = from % ny, z = from / ny;
    for (int64_t row = from; row < to; ++row) {
      f(y, z);
      if (++y < ny) continue;
      y = 0;
      ++z;
    }
  });
}

}  // namespace dpde
