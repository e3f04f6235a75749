// SPDX-License-Identifier: Apache-2.0
#include "plot/draw/layout.h"

#include <algorithm>
#include <cmath>

namespace dpde::plot {

namespace {

/// Three in a row if that leaves none over: the components and pressure of a flow, three planes, two maps and their
/// difference.
int columns_of(int panels) { return panels % 3 == 0 ? 3 : std::min(panels, 2); }

constexpr int name_height = 15, names_with_room = 4;  // of curve names below a picture
// Pixels besides the map itself: title, labels and numbers; the colour bar with its label.
constexpr int margin_above_and_below = 96, margin_beside = 172;

/// The largest aspect of the maps; 0 if a panel is not to scale.
double largest_aspect(const std::vector<Panel>& panels) {
  double largest = 0;
  for (const Panel& panel : panels) {
    const MapPanel* map = std::get_if<MapPanel>(&panel);
    const double aspect = map == nullptr ? 0 : aspect_of(*map);
    if (aspect == 0) return 0;
    largest = std::max(largest, aspect);
  }
  return largest;
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

double aspect_of(const MapPanel& panel) {
  constexpr double most = 12;
  if (panel.shape != MapShape::to_scale) return 0;
  const double aspect = std::abs((panel.y.high - panel.y.low) / (panel.x.high - panel.x.low));
  return aspect <= most && aspect >= 1 / most ? aspect : 0;
}

Layout layout_of(const std::vector<Panel>& panels) {
  constexpr double wide = 0.4;   // maps flatter than this take a row each
  constexpr double highest = 1;  // higher maps become narrower
  const int count = static_cast<int>(panels.size());
  Layout layout;
  layout.columns = columns_of(count);
  const double aspect = largest_aspect(panels);
  if (aspect > 0) {
    if (aspect < wide) {
      layout.columns = 1;
      layout.width = 2 * panel_width;
    }
    const double map_height = std::min(aspect, highest) * (layout.width - margin_beside);
    layout.height = static_cast<int>(std::lround(map_height)) + margin_above_and_below;
  } else {
    layout.height += names_height(panels);
  }
  layout.rows = (count + layout.columns - 1) / std::max(layout.columns, 1);
  return layout;
}

}  // namespace dpde::plot
