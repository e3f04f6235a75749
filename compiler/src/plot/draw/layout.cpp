// SPDX-License-Identifier: Apache-2.0
#include "plot/draw/layout.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace dpde::plot {

namespace {

/// Three in a row, as the components and the pressure of a flow, three planes, or two maps and their difference; four
/// fill a square.
int columns_of(int panels) { return panels == 3 || panels > 4 ? 3 : std::min(panels, 2); }

constexpr int name_height = 15, names_with_room = 4;  // of curve names below a picture
// Pixels besides the map itself: title, labels and numbers; the colour bar with its label.
constexpr int margin_above_and_below = 96, margin_beside = 172;

/// The smallest and the largest aspect of the maps; nullopt if a panel is not to scale.
std::optional<ValueRange> aspects_of(const std::vector<Panel>& panels) {
  std::vector<double> aspects;
  for (const Panel& panel : panels) {
    const MapPanel* map = std::get_if<MapPanel>(&panel);
    const double aspect = map == nullptr ? 0 : aspect_of(*map);
    if (aspect == 0) return std::nullopt;
    aspects.push_back(aspect);
  }
  return range_of(aspects);
}

/// For the names below the panels.
int names_height(const std::vector<Panel>& panels) {
  std::size_t names = 0;
  for (const Panel& panel : panels) {
    const LinePanel* lines = std::get_if<LinePanel>(&panel);
    if (lines != nullptr && lines->names_below) names = std::max(names, lines->curves.size());
  }
  return name_height * std::max(0, static_cast<int>(names) - names_with_room);
}

}  // namespace

MapSize map_size(const Layout& layout, const MapPanel& panel) {
  const double width = layout.width - margin_beside, height = layout.height - margin_above_and_below;
  const double aspect = aspect_of(panel);
  return aspect == 0 ? MapSize{width, height}
                     : MapSize{std::min(width, height / aspect), std::min(height, width * aspect)};
}

double aspect_of(const MapPanel& panel) {
  constexpr double most = 12;
  if (panel.shape != MapShape::to_scale) return 0;
  const auto length = [](const MapAxis& axis) {
    return axis.frame ? axis.frame->high - axis.frame->low : std::abs(axis.high - axis.low);
  };
  const double aspect = length(panel.y) / length(panel.x);
  return aspect <= most && aspect >= 1 / most ? aspect : 0;
}

Layout layout_of(const std::vector<Panel>& panels) {
  constexpr double wide = 0.4;       // maps flatter than this take a row each
  constexpr double highest = 1;      // higher maps become narrower
  constexpr double narrowest = 250;  // for titles
  const int count = static_cast<int>(panels.size());
  Layout layout;
  layout.columns = columns_of(count);
  if (layout.columns == 3) layout.width = panel_width_of_three;
  if (const std::optional<ValueRange> aspects = aspects_of(panels)) {
    if (aspects->high < wide) {
      layout.columns = 1;
      layout.width = row_width;
    }
    const double height = std::min(aspects->high, highest) * (layout.width - margin_beside);
    const double width = std::max(height / aspects->low, narrowest);
    layout.height = static_cast<int>(std::lround(height)) + margin_above_and_below;
    layout.width = std::min(layout.width, static_cast<int>(std::lround(width)) + margin_beside);
  } else {
    layout.height += names_height(panels);
  }
  layout.rows = (count + layout.columns - 1) / std::max(layout.columns, 1);
  return layout;
}

}  // namespace dpde::plot
