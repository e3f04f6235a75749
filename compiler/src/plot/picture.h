// SPDX-License-Identifier: Apache-2.0
// Pictures as SVG and PNG by gnuplot: panels with curves and coloured maps.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "source/diagnostic.h"

namespace dpde::plot {

enum class Symbol { small_dot, dot, ring, square, cross };
struct Curve {
  std::string title;
  std::vector<double> x, y;
  bool points = false;                // marks instead of a line
  std::vector<double> low, high;      // for each point, or empty: error bars of y, and marks on the line
  std::vector<double> sizes = {};     // sizes of these marks, 1: default; empty: all equal
  Symbol symbol = Symbol::small_dot;  // for marks instead of a line
  std::string colour = {};            // "#999999"; "": by the curve's number
  bool is_dashed = false;             // shows a curve that it covers
};
/// Colour of the curve with this number.
std::string colour_of_curve(std::size_t number);

/// Range of the axis or colours, common to pictures that are compared.
struct ValueRange {
  double low = 0, high = 1;
};
struct LinePanel {
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;
  std::optional<ValueRange> range = {}, x_range = {};  // nullopt: those of the values
  std::vector<Curve> curves;
  bool names_below = false;  // put the names below the picture, for many curves or long names
  std::string corner;        // small text at the upper right
  double wall = 0;           // everything left of it is grey; 0: none
};
/// What a map's coordinates are. to_scale: lengths of one unit; stretched: drawn without a common scale; polar: x is r
/// and y is theta; sphere: longitude and latitude in radians.
enum class MapShape { to_scale, stretched, polar, sphere };
using Polyline = std::vector<std::pair<double, double>>;  // in the map's coordinates
struct MapAxis {
  std::string label;
  int cells = 0;
  double low = 0, high = 1;
  std::vector<double> faces = {};        // for cells of different widths, one more than cells; else empty
  std::optional<ValueRange> frame = {};  // what is shown; nullopt: all
};
/// Values of shape (y.cells, x.cells), x fastest.
struct MapPanel {
  std::string title, value_label;
  MapAxis x, y;
  std::vector<double> values;
  std::optional<ValueRange> range;
  MapShape shape = MapShape::to_scale;
  bool is_in_degrees = false;
  std::vector<Polyline> lines;  // drawn over the map: outlines of bodies
};
using Panel = std::variant<LinePanel, MapPanel>;

bool have_gnuplot();

/// The plane of values on three axes (x fastest) with the given index along the axis `across`.
std::vector<double> plane_of(const std::vector<double>& values, const std::array<std::int64_t, 3>& cells, int across,
                             std::int64_t index);

/// Sets the common range of all maps in each of them.
void share_range(std::span<Panel> panels);

/// The range of the finite values; nullopt if there are none.
std::optional<ValueRange> range_of(const std::vector<double>& values);

/// Colours of a map with values in this range. Signed values: red and blue around zero. Values of one sign, with slight
/// excess beyond 0: a single hue.
struct Colours {
  ValueRange range;
  bool is_signed = false;
};
Colours colours_of(const std::optional<ValueRange>& range);

/// Whether the curves need a logarithmic axis: positive, with the largest value above 1000 times the smallest.
bool spans_decades(const std::vector<Curve>& curves);

enum class Formats { svg_and_png, png };
/// Writes `stem`.svg and `stem`.png and returns their paths. Without gnuplot it returns nothing and reports nothing
/// (see have_gnuplot). Failures of gnuplot and of the disk are reported.
std::vector<std::string> draw(const std::filesystem::path& stem, const std::vector<Panel>& given, DiagnosticSink& sink,
                              Formats formats = Formats::svg_and_png);
/// Writes a film of pages with equal layout: `stem`.mp4 if ffmpeg is installed, else `stem`.gif.
std::vector<std::string> draw_film(const std::filesystem::path& stem, const std::vector<std::vector<Panel>>& pages,
                                   DiagnosticSink& sink);

}  // namespace dpde::plot
