// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "stencil/interpret/interpret.h"

namespace dpde::stencil {

void apply(State& state, const Reduce& reduce) {
  const CellIndex& cells = state.grid().cells;
  CellIndex groups = cells, along{1, 1, 1};
  for (int axis = 0; axis < max_rank; ++axis) {
    if (reduce.over[axis]) std::swap(groups[axis], along[axis]);
  }
  const double count = static_cast<double>(along[0]) * along[1] * along[2];
  const bool adds = reduce.kind == Reduction::mean || reduce.kind == Reduction::sum;
  if (!state.has(reduce.result)) state.poison(reduce.result);
  for_each_cell({}, groups, [&](const CellIndex& begin) {
    double value = adds ? 0 : state.at(reduce.field, begin);
    const auto place = [&](const CellIndex& way) {
      return CellIndex{begin[0] + way[0], begin[1] + way[1], begin[2] + way[2]};
    };
    for_each_cell({}, along, [&](const CellIndex& way) {
      const double next = state.at(reduce.field, place(way));
      const bool is_better = next != next || (reduce.kind == Reduction::max ? next > value : next < value);
      value = adds ? value + next : is_better ? next : value;
    });
    if (reduce.kind == Reduction::mean) value /= count;
    for_each_cell({}, along, [&](const CellIndex& way) { state.at(reduce.result, place(way)) = state.stored(value); });
  });
}

}  // namespace dpde::stencil
