// SPDX-License-Identifier: Apache-2.0
// Finds all matrix entries in boxes around the cells, by applying the operator to unit vectors. Cells whose boxes do
// not overlap share one vector (colours along each axis: solve/multigrid/axis_colours.h).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "solve/fourier/grid_place.h"
#include "solve/matrix/stencil_matrix.h"
#include "solve/multigrid/axis_colours.h"

namespace dpde {

/// Applies the operator to interior values, x fastest.
using LinearImage = std::function<void(std::span<const double> values, std::span<double> image)>;

struct BoxShape {
  std::array<std::int64_t, 3> cells;
  std::array<bool, 3> periodic;
  std::array<std::int64_t, 3> reach;  // stencil radius; -1: the whole axis

  std::array<AxisColours, 3> colours() const {
    return {AxisColours(cells[0], periodic[0], reach[0]), AxisColours(cells[1], periodic[1], reach[1]),
            AxisColours(cells[2], periodic[2], reach[2])};
  }
};

class BoxProbe {
 public:
  /// `axes`: colours of the shape. `from`, `to`: memory for values of all cells. `used`: a matrix whose memory may be
  /// reused.
  BoxProbe(const LinearImage& image, const BoxShape& shape, const std::array<AxisColours, 3>& axes,
           std::span<double> from, std::span<double> to, StencilMatrix used = {});

  /// Number of applications in all().
  std::int64_t count() const { return axes_[0].count * axes_[1].count * axes_[2].count; }
  StencilMatrix all();
  static constexpr int images_of_some = 3;
  /// Offsets of the entries in columns of cells at the middle of boxes, at their low corners, next to walls, and at
  /// their high ones. `used`: memory for them.
  std::vector<std::array<int, 3>> some_offsets(std::vector<std::array<int, 3>> used = {});

 private:
  void take(const GridPlace& colour, bool has_values);
  std::size_t number_of_offset(const std::array<int, 3>& offset);
  std::vector<double>& column(std::size_t offset);

  const LinearImage& image_;
  BoxShape shape_;
  const std::array<AxisColours, 3>& axes_;
  std::span<double> from_, to_;
  StencilMatrix matrix_;
  std::size_t columns_ = 0;  // columns of the matrix that are new, not those of `used`
};

}  // namespace dpde
