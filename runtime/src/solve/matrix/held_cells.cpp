// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/held_cells.h"

namespace dpde {

FreeCells without_held_cells(const StencilMatrix& matrix, const NullSpace& null_space) {
  FreeCells free;
  std::vector<int> place(static_cast<std::size_t>(matrix.size()), 0);
  for (const auto& part : null_space.parts()) place[part.front()] = -1;
  for (std::uint32_t cell = 0; cell < place.size(); ++cell) {
    if (place[cell] < 0) continue;
    place[cell] = static_cast<int>(free.cells.size());
    free.cells.push_back(cell);
  }
  std::vector<Eigen::Triplet<double>> entries;
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) {
    if (place[row] >= 0 && place[column] >= 0) entries.emplace_back(place[row], place[column], value);
  });
  const auto size = static_cast<Eigen::Index>(free.cells.size());
  free.matrix.resize(size, size);
  free.matrix.setFromTriplets(entries.begin(), entries.end());
  return free;
}

}  // namespace dpde
