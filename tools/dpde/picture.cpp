// SPDX-License-Identifier: Apache-2.0
// Writes one gnuplot script with the data inside, runs gnuplot in a temporary folder, moves the results to their place.
#include "picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "files/files.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/process.h"

namespace dpde::tools {
namespace fs = std::filesystem;

namespace {

constexpr int panel_width = 640, panel_height = 440;  // pixels
constexpr int name_height = 15, names_with_room = 4;  // of what stands below a picture

/// A gnuplot string: single quotes take nothing but themselves specially.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c == '\n' ? ' ' : c);
  return result + "'";
}

std::string number(double value) { return std::isfinite(value) ? fmt::format("{:.9g}", value) : "NaN"; }

std::string data_of(const LinePanel& panel, int index) {
  std::string text;
  for (std::size_t c = 0; c < panel.curves.size(); ++c) {
    const Curve& curve = panel.curves[c];
    text += fmt::format("$p{}c{} << EOD\n", index, c);
    for (std::size_t i = 0; i < curve.y.size(); ++i) {
      text += number(curve.x[i]) + " " + number(curve.y[i]);
      if (!curve.low.empty()) text += " " + number(curve.low[i]) + " " + number(curve.high[i]);
      if (!curve.sizes.empty()) text += " " + number(curve.sizes[i]);
      text += "\n";
    }
    text += "EOD\n";
  }
  return text;
}

/// Cells below one pixel, as far as `end`.
struct Span {
  int begin = 0, end = 0;
};

/// Of equal pixels, at most `most`: those whose centres they cover, else the one below their middle.
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

/// Places rise to the right and upwards, whatever way the cells are counted.
MapPanel with_rising_places(MapPanel panel) {
  const auto row = [&](int y) { return panel.values.begin() + std::ptrdiff_t{y} * panel.nx; };
  if (panel.x_low > panel.x_high) {
    for (int y = 0; y < panel.ny; ++y) std::reverse(row(y), row(y + 1));
    std::reverse(panel.x_faces.begin(), panel.x_faces.end());
    std::swap(panel.x_low, panel.x_high);
  }
  if (panel.y_low > panel.y_high) {
    for (int y = 0; y < panel.ny / 2; ++y) std::swap_ranges(row(y), row(y + 1), row(panel.ny - 1 - y));
    std::reverse(panel.y_faces.begin(), panel.y_faces.end());
    std::swap(panel.y_low, panel.y_high);
  }
  return panel;
}

/// The panel with equal pixels in the place of cells, no more of them than the picture has: each the mean of its cells,
/// so that one that is not finite shows. The colours are those of the values themselves.
MapPanel with_pixels(MapPanel panel) {
  panel = with_rising_places(std::move(panel));
  if (panel.x_faces.empty() && panel.y_faces.empty() && panel.nx <= panel_width && panel.ny <= panel_height)
    return panel;
  if (!panel.range) panel.range = range_of(panel.values);
  const std::vector<Span> columns = cells_below_pixels(panel.nx, panel.x_faces, panel_width);
  const std::vector<Span> rows = cells_below_pixels(panel.ny, panel.y_faces, panel_height);
  std::vector<double> values;
  for (const Span row : rows) {
    for (const Span column : columns) {
      double sum = 0;
      for (int y = row.begin; y < row.end; ++y) {
        for (int x = column.begin; x < column.end; ++x)
          sum += panel.values[std::size_t(y) * std::size_t(panel.nx) + std::size_t(x)];
      }
      values.push_back(sum / (double(row.end - row.begin) * (column.end - column.begin)));
    }
  }
  panel.values = std::move(values);
  panel.nx = static_cast<int>(columns.size());
  panel.ny = static_cast<int>(rows.size());
  panel.x_faces = panel.y_faces = {};
  return panel;
}

LinePanel with_pixels(LinePanel panel) { return panel; }

std::string data_of(const MapPanel& panel, int index) {
  std::string text = fmt::format("$p{} << EOD\n", index);
  for (int y = 0; y < panel.ny; ++y) {
    for (int x = 0; x < panel.nx; ++x) text += number(panel.values[std::size_t(y) * panel.nx + x]) + " ";
    text += "\n";
  }
  return text + "EOD\n";
}

std::string labels_of(const std::string& title, const std::string& x_label, const std::string& y_label) {
  return fmt::format("set title {} noenhanced\nset xlabel {} noenhanced\nset ylabel {} noenhanced\n", quoted(title),
                     quoted(x_label), quoted(y_label));
}

/// gnuplot's number of a symbol, and its size.
std::string symbol_of(Symbol symbol) {
  switch (symbol) {
    case Symbol::small_dot: return "pt 7 ps 0.4";
    case Symbol::dot: return "pt 7 ps 0.6";
    case Symbol::ring: return "pt 6 ps 1.8";
    case Symbol::square: return "pt 4 ps 1.6";
    case Symbol::cross: return "pt 2 ps 0.8";
  }
  unreachable("symbol");
}

/// With the name of the curve's data, and its title.
std::string plot_of(const Curve& curve, const std::string& data, std::size_t number, const std::string& title) {
  const std::string colour =
      curve.colour.empty() ? fmt::format("{}", number + 1) : fmt::format("rgb '{}'", curve.colour);
  if (!curve.low.empty() && !curve.sizes.empty())
    return fmt::format(
        "{0} using 1:2:3:4 with yerrorlines lw 1.5 pt 7 ps 0.1 lc {1} title {2}, {0} using 1:2:5 with points pt 7 ps "
        "variable lc {1} notitle",
        data, colour, title);
  const std::string style =
      !curve.low.empty() ? fmt::format("using 1:2:3:4 with yerrorlines lw 1.5 pt 7 ps 0.6 lc {}", colour)
      : curve.points     ? fmt::format("using 1:2 with points {} lc {}", symbol_of(curve.symbol), colour)
                         : fmt::format("using 1:2 with lines lw 2 lc {}", colour);
  return fmt::format("{} {} title {}", data, style, title);
}

std::string plot_of(const LinePanel& panel, int index) {
  std::string text = labels_of(panel.title, panel.x_label, panel.y_label);
  if (panel.names_below)  // a second line keeps them off the label
    text += fmt::format("set xlabel {}.\"\\n \" noenhanced\n", quoted(panel.x_label));
  text += panel.log_y ? "unset logscale\nset logscale y\nset format y '%.0e'\n" : "unset logscale\nset format y '%g'\n";
  text += panel.log_x ? "set logscale x\nset format x '%.0e'\n" : "set format x '%g'\n";
  text += "set autoscale\n";
  // Room above and below; equal values have none of their own.
  if (panel.range) {
    const double room = panel.range->high > panel.range->low ? 0.05 * (panel.range->high - panel.range->low) : 0.5;
    text += fmt::format("set yrange [{}:{}]\n", number(panel.range->low - room), number(panel.range->high + room));
  }
  text += fmt::format("unset label\nset label {} at graph 0.99,0.96 right font ',8' tc rgb '#777777' noenhanced\n",
                      quoted(panel.corner));
  text += "unset object\n";
  if (panel.wall > 0)
    text += fmt::format(
        "set object 1 rectangle from graph 0, graph 0 to first {}, graph 1 fc rgb '#eeeeee' fs solid noborder behind\n",
        number(panel.wall));
  text += fmt::format("set grid lc rgb '#dddddd'\nset key {} noenhanced\nunset colorbox\nplot ",
                      panel.names_below ? "below left Left reverse maxcols 2" : "top right");
  for (std::size_t c = 0; c < panel.curves.size(); ++c) {
    if (c > 0) text += ", ";
    const Curve& curve = panel.curves[c];
    text += plot_of(curve, fmt::format("$p{}c{}", index, c), c, panel.curves.size() > 1 ? quoted(curve.title) : "''");
  }
  return text + "\n";
}

std::string plot_of(const MapPanel& panel, int index) {
  const double hx = (panel.x_high - panel.x_low) / panel.nx, hy = (panel.y_high - panel.y_low) / panel.ny;
  const std::optional<ValueRange> range = panel.range ? panel.range : range_of(panel.values);
  double low = range ? range->low : INFINITY, high = range ? range->high : -INFINITY;
  if (!(high - low > 1e-7 * std::max(std::abs(low), std::abs(high)))) {  // one value everywhere, or none
    const double middle = std::isfinite(low) ? low : 0, half = middle == 0 ? 1 : std::abs(middle) / 10;
    low = middle - half;
    high = middle + half;
  }
  // Signed data: red and blue around zero; data of one sign: one hue.
  const bool is_signed = low < 0 && high > 0;
  const double bound = std::max(std::abs(low), std::abs(high));
  std::string text = labels_of(panel.title, panel.x_label, panel.y_label);
  text +=
      "unset label\nunset object\nunset logscale\nunset grid\nunset key\nset colorbox\nset format y '%g'\nset format "
      "cb '%g'\n";
  text += is_signed ? "set palette defined (0 '#2166ac', 0.5 '#f7f7f7', 1 '#b2182b')\n"
                    : "set palette defined (0 '#440154', 0.25 '#3b528b', 0.5 '#21918c', 0.75 '#5ec962', 1 '#fde725')\n";
  text += fmt::format("set cbrange [{}:{}]\n", number(is_signed ? -bound : low), number(is_signed ? bound : high));
  text += fmt::format("set xrange [{}:{}]\nset yrange [{}:{}]\n", number(panel.x_low), number(panel.x_high),
                      number(panel.y_low), number(panel.y_high));
  const double ratio = (panel.y_high - panel.y_low) / (panel.x_high - panel.x_low);
  text += ratio > 0.2 && ratio < 5 ? "set size ratio -1\n" : "set size noratio\n";
  text += fmt::format("plot $p{} matrix using ({}+$1*{}):({}+$2*{}):3 with image\nset size noratio\n", index,
                      number(panel.x_low + hx / 2), number(hx), number(panel.y_low + hy / 2), number(hy));
  return text;
}

std::string script_for(const std::vector<Panel>& given, const std::string& terminal, const fs::path& output) {
  std::vector<Panel> panels;
  for (const Panel& panel : given) panels.push_back(match(panel, [](const auto& p) { return Panel(with_pixels(p)); }));
  std::string text =
      fmt::format("set terminal {}\nset output {}\nset encoding utf8\n", terminal, quoted(output.string()));
  text +=
      "set linetype 1 lc rgb '#1f77b4'\nset linetype 2 lc rgb '#d62728'\nset linetype 3 lc rgb '#2ca02c'\n"
      "set linetype 4 lc rgb '#9467bd'\nset linetype 5 lc rgb '#ff7f0e'\nset linetype 6 lc rgb '#17becf'\n"
      "set linetype 7 lc rgb '#8c564b'\nset linetype 8 lc rgb '#e377c2'\nset linetype 9 lc rgb '#7f7f7f'\nset border "
      "3\nset tics nomirror\n";
  for (std::size_t p = 0; p < panels.size(); ++p) {
    text += match(panels[p], [&](const auto& panel) { return data_of(panel, static_cast<int>(p)); });
  }
  if (panels.size() > 1) text += fmt::format("set multiplot layout 1,{}\n", panels.size());
  for (std::size_t p = 0; p < panels.size(); ++p) {
    text += match(panels[p], [&](const auto& panel) { return plot_of(panel, static_cast<int>(p)); });
  }
  if (panels.size() > 1) text += "unset multiplot\n";
  return text + "unset output\n";
}

/// Names below a picture take none of its own height.
int height_of(const std::vector<Panel>& panels) {
  std::size_t names = 0;
  for (const Panel& panel : panels) {
    const LinePanel* lines = std::get_if<LinePanel>(&panel);
    if (lines != nullptr && lines->names_below) names = std::max(names, lines->curves.size());
  }
  return panel_height + name_height * std::max(0, static_cast<int>(names) - names_with_room);
}

}  // namespace

std::optional<ValueRange> range_of(const std::vector<double>& values) {
  ValueRange range{INFINITY, -INFINITY};
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  }
  return range.low <= range.high ? std::optional(range) : std::nullopt;
}

bool have_gnuplot() {
  static const bool found = run_process({"gnuplot", "--version"}).succeeded();
  return found;
}

std::vector<std::string> draw(const fs::path& stem, const std::vector<Panel>& panels, DiagnosticSink& sink,
                              Formats formats) {
  std::vector<std::string> files;
  if (panels.empty() || !have_gnuplot()) return files;
  const TemporaryFolder folder;
  if (folder.path().empty()) {
    sink.report("cannot-write", {}, {stem.string(), "no temporary folder could be made"});
    return files;
  }
  const int width = panel_width * static_cast<int>(panels.size()), height = height_of(panels);
  const std::string svg =
      fmt::format("svg size {},{} dynamic font 'Helvetica,13' background rgb 'white'", width, height);
  const std::string png = fmt::format("pngcairo size {},{} font 'Helvetica,10' background rgb 'white'", width, height);
  for (const auto& [extension, terminal] : {std::pair{".svg", svg}, std::pair{".png", png}}) {
    if (formats == Formats::png && extension != std::string_view(".png")) continue;
    const fs::path drawn = folder.path() / (std::string("picture") + extension);
    const fs::path script = folder.path() / (std::string("picture") + extension + ".gp");
    if (!files::write_file(script, script_for(panels, terminal, drawn), sink)) return files;
    const fs::path target = stem.string() + extension;
    if (!run_process({"gnuplot", script.string()}).succeeded()) {
      sink.report("cannot-write", {}, {target.string(), "gnuplot failed"});
      return files;
    }
    const std::optional<std::string> bytes = files::read_file(drawn, {}, sink);
    if (!bytes || !files::write_file(target, *bytes, sink)) return files;
    files.push_back(target.string());
  }
  return files;
}

}  // namespace dpde::tools
