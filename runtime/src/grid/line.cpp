// SPDX-License-Identifier: Apache-2.0
#include "grid/line.h"

namespace dpde {

bool is_line(const Sweep& sweep) {
  for (size_t i = 1; i < sweep.sums.size(); ++i) {
    if (sweep.sums[i] != sweep.sums[i - 1] + 1) return false;
  }
  return true;
}

Line make_line(const Sweep& sweep, const dpde_layout& layout, const double* uniforms, double* sums) {
  Line line{sweep.code.front().row, {}, sweep.streams, sweep.grids, sweep.then};
  line.row.uniforms = uniforms;
  line.row.own = uniforms + sweep.own;
  line.row.sums = sweep.sums.empty() ? sums : sums + sweep.sums.front();
  line.row.count = sweep.count;
  line.row.first = sweep.first + layout.first[0];
  line.row.layout = &layout;
  return line;
}

}  // namespace dpde
