// SPDX-License-Identifier: Apache-2.0
// How the panels of a picture are placed: their number in a row and their size.
#pragma once

#include <vector>

#include "plot/picture.h"

namespace dpde::plot {

/// Pixels of an SVG. A PNG has `png_scale` as many in each direction.
inline constexpr int panel_width = 640, panel_height = 440, png_scale = 2;
/// Of three panels in a row: letters are then larger for their size, since the row is as wide as a page, too.
inline constexpr int panel_width_of_three = 480;
/// Of a map that takes a row.
inline constexpr int row_width = 2 * panel_width;

struct Layout {
  int columns = 1, rows = 1;
  int width = panel_width, height = panel_height;  // of a panel
};
/// Two or three panels in a row. If all are maps to scale, panels are as high as these need, and wide ones take a row
/// each.
Layout layout_of(const std::vector<Panel>& panels);

/// About the pixels of an SVG that a map has in the layout.
struct MapSize {
  double width = 0, height = 0;
};
MapSize map_size(const Layout& layout, const MapPanel& panel);

/// Height of the map over its width, if one unit is to be as long along both axes; else 0. Very long or high maps are
/// stretched: one would not see them.
double aspect_of(const MapPanel& panel);

}  // namespace dpde::plot
