// SPDX-License-Identifier: Apache-2.0
// A grid for what depends on all places at once. A verdict samples values and slopes of solutions and means, and these
// are smoother than what they are made from: on large grids their values on fewer cells do.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::stability {

/// The scene's own grid up to 2^18 cells; beyond, the axes with most cells are halved until it has no more. Fields are
/// arrays of cells, x fastest.
class CoarseGrid {
 public:
  using Place = std::array<std::size_t, 3>;

  explicit CoarseGrid(const std::vector<model::Axis>& axes);
  /// The scene's, however many cells it has.
  static CoarseGrid own(const std::vector<model::Axis>& axes);

  /// Whether it is the scene's grid.
  bool is_own() const { return cells_ == own_; }
  /// One number an axis.
  const std::vector<int>& cells() const { return cells_; }
  /// "512 x 512 cells".
  std::string text() const;
  /// The means of the scene's cells that lie in each of these.
  std::vector<double> restricted(std::span<const double> values) const;
  /// The values of the scene's cells in the middle of each, as of masks, which have no mean.
  std::vector<double> sampled(std::span<const double> values) const;
  /// Linear between the centres of cells and beyond the last ones, in each of the scene's cells.
  std::vector<double> prolonged(std::span<const double> values) const;
  /// The same in one of them.
  double at(std::span<const double> values, const Place& own_place) const;
  /// The scene's cell in the middle of one of these.
  std::size_t middle_of(std::size_t cell) const;

 private:
  CoarseGrid(const std::vector<model::Axis>& axes, std::size_t most_cells);
  Place own_place_of(std::size_t own_cell) const;

  std::vector<int> own_, cells_;
  std::vector<bool> is_periodic_;
};

}  // namespace dpde::stability
