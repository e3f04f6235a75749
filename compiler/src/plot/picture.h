// SPDX-License-Identifier: Apache-2.0
// Pictures as SVG and PNG through gnuplot: panels of curves and of coloured maps, two side by side.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "source/diagnostic.h"

namespace dpde::plot {

enum class Symbol { small_dot, dot, ring, square, cross };
struct Curve {
  std::string title;
  std::vector<double> x, y;
  bool points = false;                // marks instead of a line
  std::vector<double> low, high;      // one each a point, or none: bars about y, and marks on the line
  std::vector<double> sizes = {};     // of these marks: 1 is the usual one; none: all the same
  Symbol symbol = Symbol::small_dot;  // of marks instead of a line
  std::string colour = {};            // "#999999"; "": by its number
};
/// Of the values shown, so that pictures can be compared.
struct ValueRange {
  double low = 0, high = 1;
};
struct LinePanel {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;
  std::optional<ValueRange> range;  // none: what the values need
  std::vector<Curve> curves;
  bool names_below = false;  // the names of many curves, or long ones, below the picture
  std::string corner;        // small, at the upper right
  double wall = 0;           // what is left of it is grey; 0: nothing
};
/// Values of shape (ny, nx), x fastest.
struct MapPanel {
  std::string title, x_label, y_label, value_label;
  int nx = 0, ny = 0;
  double x_low = 0, x_high = 1, y_low = 0, y_high = 1;
  std::vector<double> x_faces,
      y_faces;  // of cells of different widths, one more than cells; empty where they are uniform
  std::vector<double> values;
  std::optional<ValueRange> range;
};
using Panel = std::variant<LinePanel, MapPanel>;

bool have_gnuplot();

/// Of values on three axes, x fastest, those where the index along the axis `across` is `index`.
std::vector<double> plane_of(const std::vector<double>& values, const std::array<std::int64_t, 3>& cells, int across,
                             std::int64_t index);

/// That of all maps, for all of them.
void share_range(std::vector<Panel>& panels);

/// The least range that holds the finite values; nullopt when there are none.
std::optional<ValueRange> range_of(const std::vector<double>& values);

/// Whether the curves are shown by their logarithms: positive, the largest value above 1000 times the smallest.
bool spans_decades(const std::vector<Curve>& curves);

enum class Formats { svg_and_png, png };
/// Writes `stem`.svg and `stem`.png and returns their paths. Without gnuplot there is no picture: nothing is returned
/// and nothing reported (have_gnuplot tells); failures of gnuplot and of the disk are reported.
std::vector<std::string> draw(const std::filesystem::path& stem, const std::vector<Panel>& panels, DiagnosticSink& sink,
                              Formats formats = Formats::svg_and_png);
/// `stem`.gif, a film of pages that are alike.
std::vector<std::string> draw_film(const std::filesystem::path& stem, const std::vector<std::vector<Panel>>& pages,
                                   DiagnosticSink& sink);

}  // namespace dpde::plot
