// SPDX-License-Identifier: Apache-2.0
// A coarser grid for solutions and means, which depend on all points. A verdict samples their values and slopes. They
// are smoother than the fields they come from, so on large grids values on fewer cells suffice.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "model/model.h"

namespace dpde::stability {

/// The scene's own grid up to 2^18 cells; above, the longest axes are halved until the grid has at most 2^18. Fields
/// are arrays with one value per cell, x fastest, on the scene's grid ("own") or on this one. Values on faces are those
/// on the upper face of each cell, on both grids.
class CoarseGrid {
 public:
  using Place = std::array<std::size_t, 3>;

  /// \param axes the session's 1 to 3 axes, of at least 1 cell each.
  explicit CoarseGrid(const std::vector<model::Axis>& axes);
  /// The scene's grid, for any number of cells.
  static CoarseGrid own(const std::vector<model::Axis>& axes);

  /// Whether it is the scene's grid.
  bool is_own() const { return cells_ == own_; }
  /// The number of cells along each axis.
  const std::vector<int>& cells() const { return cells_; }
  /// "512 x 512 cells".
  std::string text() const;
  /// From the scene's grid to this one: the mean of the scene's cells in each cell, weighted by overlap. Along axes
  /// with values on faces: linear interpolation between the two nearest.
  std::vector<double> restricted(std::span<const double> values, const model::Placement& placement = {}) const;
  /// From this grid to the scene's: linear interpolation between cell centres or faces, linear extrapolation beyond the
  /// last ones.
  std::vector<double> prolonged(std::span<const double> values, const model::Placement& placement = {}) const;
  /// prolonged() for one of the scene's cells.
  /// \param values one per cell of this grid.
  /// \param own_place index of the scene's cell along each axis; 0 along absent axes.
  double at(std::span<const double> values, const Place& own_place, const model::Placement& placement = {}) const;
  /// The scene's cell in the middle of a cell of this grid.
  std::size_t middle_of(std::size_t cell) const;

 private:
  CoarseGrid(const std::vector<model::Axis>& axes, std::size_t most_cells);
  Place own_place_of(std::size_t own_cell) const;
  std::vector<double> restricted_along(std::size_t axis, std::span<const double> values, std::size_t stride,
                                       bool is_on_faces) const;

  std::vector<int> own_, cells_;
  std::vector<bool> is_periodic_;
};

}  // namespace dpde::stability
