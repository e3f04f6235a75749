// SPDX-License-Identifier: Apache-2.0
#include "plot/draw/pixels.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "plot/draw/layout.h"

namespace dpde::plot {

namespace {

constexpr int most_pixels = png_scale * row_width;  // of a map along an axis: it may have a row of its own

/// Range of cells covered by one pixel; `end` is excluded.
struct Span {
  int begin = 0, end = 0;
};

/// Splits cells into at most `most` equal pixels: each has the cells whose centres it covers, else the cell at its
/// middle.
std::vector<Span> cells_below_pixels(int cells, const std::vector<double>& faces, int most) {
  const auto face = [&](int i) {
    return faces.empty() ? double(i) / cells : (faces[std::size_t(i)] - faces.front()) / (faces.back() - faces.front());
  };
  double narrowest = 1;
  for (int i = 0; i < cells; ++i) narrowest = std::min(narrowest, face(i + 1) - face(i));
  const double wanted = faces.empty() ? cells : std::max<double>(cells, 2 * std::ceil(1 / narrowest));
  const int pixels = static_cast<int>(std::min<double>(most, wanted));
  std::vector<Span> below;
  for (int i = 0, cell = 0, first = 0; i < pixels; ++i) {
    while (cell + 1 < cells && face(cell + 1) <= (i + 0.5) / pixels) ++cell;
    while (first < cells && face(first) + face(first + 1) < 2.0 * i / pixels) ++first;
    int end = first;
    while (end < cells && face(end) + face(end + 1) < 2.0 * (i + 1) / pixels) ++end;
    below.push_back(end > first ? Span{first, end} : Span{cell, cell + 1});
  }
  return below;
}

/// Flips the map so that coordinates increase to the right and upwards.
MapPanel with_rising_places(MapPanel panel) {
  const auto row = [&](int y) { return panel.values.begin() + std::ptrdiff_t{y} * panel.x.cells; };
  if (panel.x.low > panel.x.high) {
    for (int y = 0; y < panel.y.cells; ++y) std::reverse(row(y), row(y + 1));
    std::reverse(panel.x.faces.begin(), panel.x.faces.end());
    std::swap(panel.x.low, panel.x.high);
  }
  if (panel.y.low > panel.y.high) {
    for (int y = 0; y < panel.y.cells / 2; ++y) std::swap_ranges(row(y), row(y + 1), row(panel.y.cells - 1 - y));
    std::reverse(panel.y.faces.begin(), panel.y.faces.end());
    std::swap(panel.y.low, panel.y.high);
  }
  return panel;
}

/// Resamples the panel to equal pixels, at most as many as the picture has. Each is the mean of its cells, so a value
/// that is not finite stays visible. Colours are those of the values.
MapPanel on_equal_pixels(MapPanel panel) {
  if (panel.x.faces.empty() && panel.y.faces.empty() && panel.x.cells <= most_pixels && panel.y.cells <= most_pixels)
    return panel;
  if (!panel.range) panel.range = range_of(panel.values);
  const std::vector<Span> columns = cells_below_pixels(panel.x.cells, panel.x.faces, most_pixels);
  const std::vector<Span> rows = cells_below_pixels(panel.y.cells, panel.y.faces, most_pixels);
  std::vector<double> values;
  for (const Span row : rows) {
    for (const Span column : columns) {
      double sum = 0;
      for (int y = row.begin; y < row.end; ++y) {
        for (int x = column.begin; x < column.end; ++x)
          sum += panel.values[std::size_t(y) * std::size_t(panel.x.cells) + std::size_t(x)];
      }
      values.push_back(sum / (double(row.end - row.begin) * (column.end - column.begin)));
    }
  }
  panel.values = std::move(values);
  panel.x.cells = static_cast<int>(columns.size());
  panel.y.cells = static_cast<int>(rows.size());
  panel.x.faces = panel.y.faces = {};
  return panel;
}

/// Longitude and latitude in degrees.
MapPanel in_degrees(MapPanel panel) {
  constexpr double degree = 180 / std::numbers::pi;
  for (MapAxis* axis : {&panel.x, &panel.y}) {
    axis->low *= degree;
    axis->high *= degree;
    if (axis->frame) axis->frame = ValueRange{axis->frame->low * degree, axis->frame->high * degree};
    for (double& face : axis->faces) face *= degree;
  }
  for (Polyline& line : panel.lines) {
    for (auto& [x, y] : line) x *= degree, y *= degree;
  }
  panel.shape = MapShape::to_scale;
  panel.is_in_degrees = true;
  return panel;
}

struct Box {
  double x_low = INFINITY, x_high = -INFINITY, y_low = INFINITY, y_high = -INFINITY;
  void take(double r, double theta) {
    x_low = std::min(x_low, r * std::cos(theta));
    x_high = std::max(x_high, r * std::cos(theta));
    y_low = std::min(y_low, r * std::sin(theta));
    y_high = std::max(y_high, r * std::sin(theta));
  }
};

/// Of a sector: its corners, and the ends of both axes that it contains.
Box box_of(const MapPanel& panel) {
  Box box;
  for (const double r : {panel.x.low, panel.x.high}) {
    for (const double theta : {panel.y.low, panel.y.high}) box.take(r, theta);
  }
  constexpr double quarter = std::numbers::pi / 2;
  for (double k = std::ceil(panel.y.low / quarter); k * quarter <= panel.y.high; ++k)
    box.take(panel.x.high, k * quarter);
  return box;
}

/// The cell that contains the point; -1 outside.
int cell_at(double point, const MapAxis& axis) {
  if (!(point >= axis.low && point <= axis.high)) return -1;
  if (axis.faces.empty())
    return std::min(static_cast<int>((point - axis.low) / (axis.high - axis.low) * axis.cells), axis.cells - 1);
  const auto above = std::upper_bound(axis.faces.begin(), axis.faces.end(), point) - axis.faces.begin();
  return std::clamp(static_cast<int>(above) - 1, 0, axis.cells - 1);
}

/// Pixels that show the smallest cell of a disc: two across it, and no fewer than a smooth rim needs.
int pixels_of_disc(const MapPanel& panel) {
  constexpr int least = 900, most = 1200;
  const double radial = 2 * panel.x.high * panel.x.cells / (panel.x.high - panel.x.low);
  const double around = 2 * panel.y.cells / (panel.y.high - panel.y.low);
  return std::clamp(static_cast<int>(2 * std::max(radial, around)), least, most);
}

MapPanel as_disc(MapPanel panel) {
  constexpr double turn = 2 * std::numbers::pi;
  if (!panel.range) panel.range = range_of(panel.values);
  const Box box = box_of(panel);
  const double width = box.x_high - box.x_low, height = box.y_high - box.y_low;
  const double pixel = std::max(width, height) / pixels_of_disc(panel);
  MapPanel disc = panel;
  disc.x.cells = std::max(1, static_cast<int>(std::lround(width / pixel)));
  disc.y.cells = std::max(1, static_cast<int>(std::lround(height / pixel)));
  disc.values.clear();
  for (int j = 0; j < disc.y.cells; ++j) {
    for (int i = 0; i < disc.x.cells; ++i) {
      const double x = box.x_low + (i + 0.5) * width / disc.x.cells, y = box.y_low + (j + 0.5) * height / disc.y.cells;
      const double angle = std::atan2(y, x), theta = angle + turn * std::ceil((panel.y.low - angle) / turn);
      const int column = cell_at(std::hypot(x, y), panel.x);
      const int row = cell_at(theta, panel.y);
      disc.values.push_back(column < 0 || row < 0
                                ? NAN
                                : panel.values[std::size_t(row) * std::size_t(panel.x.cells) + std::size_t(column)]);
    }
  }
  for (Polyline& line : disc.lines) {
    for (auto& [x, y] : line) std::tie(x, y) = std::pair(x * std::cos(y), x * std::sin(y));
  }
  disc.x.faces = disc.y.faces = {};
  disc.x.frame = disc.y.frame = std::nullopt;
  disc.x.low = box.x_low, disc.x.high = box.x_high, disc.y.low = box.y_low, disc.y.high = box.y_high;
  disc.shape = MapShape::to_scale;
  return disc;
}

/// Twice the only row or column: gnuplot draws no image of one.
MapPanel with_two_rows(MapPanel panel) {
  if (panel.x.cells == 1) {
    std::vector<double> values;
    for (const double value : panel.values) values.insert(values.end(), {value, value});
    panel.values = std::move(values);
    panel.x.cells = 2;
    panel.x.faces = {};
  }
  if (panel.y.cells == 1) {
    const std::vector<double> row = panel.values;
    panel.values.insert(panel.values.end(), row.begin(), row.end());
    panel.y.cells = 2;
    panel.y.faces = {};
  }
  return panel;
}

}  // namespace

MapPanel with_pixels(MapPanel panel) {
  panel = with_two_rows(with_rising_places(std::move(panel)));
  if (panel.shape == MapShape::polar) return as_disc(std::move(panel));
  if (panel.shape == MapShape::sphere) panel = in_degrees(std::move(panel));
  return on_equal_pixels(std::move(panel));
}

}  // namespace dpde::plot
