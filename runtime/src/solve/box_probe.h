// SPDX-License-Identifier: Apache-2.0
// All entries of rows in boxes around their cells, by unit vectors of cells whose boxes do not meet (colours along each
// axis: solve/axis_colours.h).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "solve/axis_colours.h"
#include "solve/grid_place.h"
#include "solve/stencil_matrix.h"

namespace dpde {

/// Makes the image of interior values, x fastest.
using LinearImage = std::function<void(std::span<const double> values, std::span<double> image)>;

struct BoxShape {
  std::array<std::int64_t, 3> cells;
  std::array<bool, 3> periodic;
  std::array<std::int64_t, 3> reach;  // from a cell; -1: anywhere
};

class BoxProbe {
 public:
  /// `from`, `to`: memory for values of all cells. `used`: a matrix whose memory may be taken.
  BoxProbe(const LinearImage& image, const BoxShape& shape, std::span<double> from, std::span<double> to,
           StencilMatrix used = {});

  /// Images that all() takes.
  std::int64_t count() const { return axes_[0].count * axes_[1].count * axes_[2].count; }
  StencilMatrix all();
  static constexpr int images_of_some = 3;
  /// Offsets of the entries in columns of cells in the middles of boxes, in their low corners, which are beside walls,
  /// and in their high ones.
  std::vector<std::array<int, 3>> some_offsets();

 private:
  void take(const GridPlace& colour, bool has_values);
  std::size_t number_of_offset(const std::array<int, 3>& offset);
  std::vector<double>& column(std::size_t offset);

  const LinearImage& image_;
  BoxShape shape_;
  std::array<AxisColours, 3> axes_;
  std::span<double> from_, to_;
  std::vector<std::vector<double>> used_;
  StencilMatrix matrix_;
};

}  // namespace dpde
