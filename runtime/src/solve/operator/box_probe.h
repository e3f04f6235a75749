// SPDX-License-Identifier: Apache-2.0
// All entries of rows in boxes around their cells, by unit vectors of cells whose boxes do not meet (colours along each
// axis: solve/axis_colours.h).
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

/// Makes the image of interior values, x fastest.
using LinearImage = std::function<void(std::span<const double> values, std::span<double> image)>;

struct BoxShape {
  std::array<std::int64_t, 3> cells;
  std::array<bool, 3> periodic;
  std::array<std::int64_t, 3> reach;  // from a cell; -1: anywhere

  std::array<AxisColours, 3> colours() const {
    return {AxisColours(cells[0], periodic[0], reach[0]), AxisColours(cells[1], periodic[1], reach[1]),
            AxisColours(cells[2], periodic[2], reach[2])};
  }
};

class BoxProbe {
 public:
  /// `axes`: colours of the shape. `from`, `to`: memory for values of all cells. `used`: a matrix whose memory may be
  /// taken.
  BoxProbe(const LinearImage& image, const BoxShape& shape, const std::array<AxisColours, 3>& axes,
           std::span<double> from, std::span<double> to, StencilMatrix used = {});

  /// Images that all() takes.
  std::int64_t count() const { return axes_[0].count * axes_[1].count * axes_[2].count; }
  StencilMatrix all();
  static constexpr int images_of_some = 3;
  /// Offsets of the entries in columns of cells in the middles of boxes, in their low corners, which are beside walls,
  /// and in their high ones. `used`: memory for them.
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
  std::size_t columns_ = 0;  // of the matrix that are its own, and not of what it was
};

}  // namespace dpde
