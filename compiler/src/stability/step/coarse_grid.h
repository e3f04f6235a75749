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
/// arrays with one value a cell, x fastest, of the scene's cells or of these: values on faces are those on the upper
/// face of each cell, on both grids.
class CoarseGrid {
 public:
  using Place = std::array<std::size_t, 3>;

  /// \param axes 1 to 3, as the session has them: of at least 1 cell each.
  explicit CoarseGrid(const std::vector<model::Axis>& axes);
  /// The scene's, however many cells it has.
  static CoarseGrid own(const std::vector<model::Axis>& axes);

  /// Whether it is the scene's grid.
  bool is_own() const { return cells_ == own_; }
  /// One number an axis.
  const std::vector<int>& cells() const { return cells_; }
  /// "512 x 512 cells".
  std::string text() const;
  /// The means of the scene's cells in each of these, by the part of them that lies in it; along axes where the values
  /// lie on faces, linear between the two that are nearest. One value of each of its cells to one of each of these.
  std::vector<double> restricted(std::span<const double> values, const model::Placement& placement = {}) const;
  /// Linear between the centres of cells, or faces, and beyond the last ones: one value of each of these cells to one
  /// of each of the scene's.
  std::vector<double> prolonged(std::span<const double> values, const model::Placement& placement = {}) const;
  /// The same in one of the scene's cells.
  /// \param values one of each of these cells.
  /// \param own_place the scene's cell, its number along each axis; 0 along axes there are not.
  double at(std::span<const double> values, const Place& own_place, const model::Placement& placement = {}) const;
  /// The scene's cell in the middle of one of these.
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
