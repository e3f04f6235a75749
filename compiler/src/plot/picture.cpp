// SPDX-License-Identifier: Apache-2.0
// Writes one gnuplot script with embedded data, runs gnuplot in a temporary folder, and moves the results to their
// final location.
#include "plot/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "files/files.h"
#include "plot/draw/layout.h"
#include "plot/draw/pixels.h"
#include "plot/draw/readable_values.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/process.h"

namespace dpde::plot {
namespace fs = std::filesystem;

namespace {

/// A gnuplot string in single quotes, in which only the quote itself is special.
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

std::string data_of(const MapPanel& panel, int index) {
  std::string text = fmt::format("$p{} << EOD\n", index);
  for (int y = 0; y < panel.y.cells; ++y) {
    for (int x = 0; x < panel.x.cells; ++x) text += number(panel.values[std::size_t(y) * panel.x.cells + x]) + " ";
    text += "\n";
  }
  text += "EOD\n";
  if (panel.lines.empty()) return text;
  text += fmt::format("$p{}lines << EOD\n", index);
  for (const Polyline& line : panel.lines) {
    for (const auto& [x, y] : line) text += number(x) + " " + number(y) + "\n";
    text += "\n";
  }
  return text + "EOD\n";
}

/// Typesets units: superscript powers, products as dots: m^2*K is m\u00b2\u00b7K.
std::string typeset(const std::string& label) {
  constexpr const char* digits[] = {"\u2070", "\u00b9", "\u00b2", "\u00b3", "\u2074",
                                    "\u2075", "\u2076", "\u2077", "\u2078", "\u2079"};
  const auto is_digit = [&](std::size_t i) { return i < label.size() && label[i] >= '0' && label[i] <= '9'; };
  std::string text;
  for (std::size_t i = 0; i < label.size(); ++i) {
    if (label[i] == '*') {
      text += "\u00b7";
    } else if (label[i] == '^' && is_digit(i + 1)) {
      for (; is_digit(i + 1); ++i) text += digits[label[i + 1] - '0'];
    } else {
      text += label[i];
    }
  }
  return text;
}

/// A title that is longer than its panel is in smaller letters.
std::string title_of(const std::string& title, int width) {
  constexpr int letters = 12, least = 7;
  constexpr double of_a_letter = 0.65;  // its width, in units of its height
  const double fitting = width / (of_a_letter * static_cast<double>(std::max<std::size_t>(title.size(), 1)));
  const std::string font = fitting < letters ? fmt::format(" font ',{}'", std::max(least, int(fitting))) : "";
  return fmt::format("set title {} noenhanced{}\n", quoted(title), font);
}

std::string labels_of(const std::string& x_label, const std::string& y_label) {
  return fmt::format("set xlabel {} noenhanced\nset ylabel {} noenhanced\n", quoted(typeset(x_label)),
                     quoted(typeset(y_label)));
}

/// gnuplot's number and size of a symbol.
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

/// Plot command for the curve's data block, with its title.
std::string plot_of(const Curve& curve, const std::string& data, std::size_t number, const std::string& title) {
  const std::string line =
      (curve.colour.empty() ? fmt::format("lt {}", number + 1) : fmt::format("lc rgb '{}'", curve.colour)) +
      (curve.is_dashed ? " dt 2" : "");
  if (!curve.low.empty() && !curve.sizes.empty())
    return fmt::format(
        "{0} using 1:2:3:4 with yerrorlines {1} lw 1.5 pt 7 ps 0.1 title {2}, {0} using 1:2:5 with points {1} pt 7 ps "
        "variable notitle",
        data, line, title);
  const std::string style = !curve.low.empty()
                                ? fmt::format("using 1:2:3:4 with yerrorlines {} lw 1.5 pt 7 ps 0.6", line)
                            : curve.points ? fmt::format("using 1:2 with points {} {}", line, symbol_of(curve.symbol))
                                           : fmt::format("using 1:2 with lines {} lw 2", line);
  return fmt::format("{} {} title {}", data, style, title);
}

/// Lines extend to the frame; marks keep a margin.
std::string limits_of(const LinePanel& panel) {
  const auto is_line = [](const Curve& curve) { return !curve.points && curve.low.empty(); };
  return std::ranges::all_of(panel.curves, is_line) ? "set autoscale xfix\n" : "";
}

/// A logarithmic axis: labels 1, 10, 100 if that is short, else powers of ten; ticks between them only if there is
/// room.
std::string decades_of(const LinePanel& panel, const char* axis, std::vector<double> Curve::*values) {
  constexpr double least = 1e-3, most = 1e4, with_ticks = 1e6;
  std::vector<double> ends;
  for (const Curve& curve : panel.curves) {
    if (const std::optional<ValueRange> range = range_of(curve.*values))
      ends.insert(ends.end(), {range->low, range->high});
  }
  const ValueRange range = range_of(ends).value_or(ValueRange{1, 1});
  return fmt::format("set logscale {0}\nset format {0} '{1}'\nset m{0}tics {2}\n", axis,
                     range.low >= least && range.high <= most ? "%g" : "10^{%T}",
                     range.high > with_ticks * range.low ? "1" : "default");
}

std::string linear_axis(const char* axis) { return fmt::format("set format {0} '%g'\nunset m{0}tics\n", axis); }

std::string plot_of(const LinePanel& panel, int index, const Layout& layout) {
  std::string text = title_of(panel.title, layout.width) + labels_of(panel.x_label, panel.y_label);
  if (panel.names_below || panel.curves.size() > 1)  // a second line separates them from the label
    text += fmt::format("set xlabel {}.\"\\n \" noenhanced\n", quoted(typeset(panel.x_label)));
  text += "unset logscale\n" + (panel.log_y ? decades_of(panel, "y", &Curve::y) : linear_axis("y"));
  text += panel.log_x ? decades_of(panel, "x", &Curve::x) : linear_axis("x");
  text += "set border 3\nset tics in\nset xtics autofreq\nset ytics autofreq\nset autoscale\n" + limits_of(panel);
  // Margin above and below; a constant curve has no extent of its own.
  if (panel.range) {
    const double room = panel.range->high > panel.range->low ? 0.05 * (panel.range->high - panel.range->low) : 0.5;
    text += fmt::format("set yrange [{}:{}]\n", number(panel.range->low - room), number(panel.range->high + room));
  }
  if (panel.x_range)
    text += fmt::format("set xrange [{}:{}]\n", number(panel.x_range->low), number(panel.x_range->high));
  text += fmt::format("unset label\nset label {} at graph 0.99,0.96 right font ',8' tc rgb '#777777' noenhanced\n",
                      quoted(panel.corner));
  text += "unset object\n";
  if (panel.wall > 0)
    text += fmt::format(
        "set object 1 rectangle from graph 0, graph 0 to first {}, graph 1 fc rgb '#eeeeee' fs solid noborder behind\n",
        number(panel.wall));
  text += fmt::format("set grid lc rgb '#dddddd'\nset key {} noenhanced\nunset colorbox\nplot ",
                      panel.names_below ? "below left Left reverse maxcols 2" : "below center horizontal Left reverse");
  for (std::size_t c = 0; c < panel.curves.size(); ++c) {
    if (c > 0) text += ", ";
    const Curve& curve = panel.curves[c];
    text += plot_of(curve, fmt::format("$p{}c{}", index, c), c, panel.curves.size() > 1 ? quoted(curve.title) : "''");
  }
  return text + "\n";
}

/// The distance of ticks, 1, 2 or 5 times a power of ten, that leaves each number its room along so many pixels.
double tick_step(double extent, double pixels, double room) {
  const double least = extent / std::max(pixels / room, 2.0), power = std::pow(10, std::floor(std::log10(least)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= least) return step * power;
  }
  return 10 * power;
}

ValueRange frame_of(const MapAxis& shown) { return shown.frame.value_or(ValueRange{shown.low, shown.high}); }
double extent_of(const MapAxis& shown) { return frame_of(shown).high - frame_of(shown).low; }

std::string frame_of(const char* axis, const MapAxis& shown) {
  const ValueRange range = frame_of(shown);
  return fmt::format("set {}range [{}:{}]\n", axis, number(range.low), number(range.high));
}

std::string plot_of(const MapPanel& panel, int index, const Layout& layout) {
  constexpr double room_of_number = 64, room_of_line = 36;  // along an axis, pixels
  const MapSize size = map_size(layout, panel);
  const double hx = (panel.x.high - panel.x.low) / panel.x.cells, hy = (panel.y.high - panel.y.low) / panel.y.cells;
  const Colours colours = colours_of(panel.range ? panel.range : range_of(panel.values));
  std::string text = title_of(panel.title, layout.width) + labels_of(panel.x.label, panel.y.label);
  text +=
      "set border 15\nset tics out\nunset mxtics\nunset mytics\nunset label\nunset object\nunset logscale\nunset "
      "grid\nunset key\nset "
      "colorbox\nset format x '%g'\nset format y '%g'\nset format "
      "cb '%g'\n";
  text += colours.is_signed
              ? "set palette defined (0 '#2166ac', 0.5 '#f7f7f7', 1 '#b2182b')\n"
              : "set palette defined (0 '#440154', 0.25 '#3b528b', 0.5 '#21918c', 0.75 '#5ec962', 1 '#fde725')\n";
  text += fmt::format("set cblabel {} noenhanced offset 0.6,0\n", quoted(typeset(panel.value_label)));
  text += fmt::format("set cbrange [{}:{}]\nset cbtics {}\n", number(colours.range.low), number(colours.range.high),
                      number(tick_step(colours.range.high - colours.range.low, size.height, room_of_line)));
  text += frame_of("x", panel.x) + frame_of("y", panel.y);
  text += panel.is_in_degrees ? "set xtics 60\nset ytics 30\n"
                              : fmt::format("set xtics {}\nset ytics {}\n",
                                            number(tick_step(extent_of(panel.x), size.width, room_of_number)),
                                            number(tick_step(extent_of(panel.y), size.height, room_of_line)));
  text += aspect_of(panel) > 0 ? "set size ratio -1\n" : "set size noratio\n";
  text += fmt::format("plot $p{} matrix using ({}+$1*{}):({}+$2*{}):3 with image", index, number(panel.x.low + hx / 2),
                      number(hx), number(panel.y.low + hy / 2), number(hy));
  if (!panel.lines.empty()) text += fmt::format(", $p{}lines using 1:2 with lines lc rgb '#222222' lw 1.2", index);
  return text + "\nset size noratio\n";
}

/// Colours that are distinguishable with red-green colour blindness (Okabe and Ito, jfly.uni-koeln.de/color, without
/// the yellow, which is invisible on white); further curves repeat them dashed.
constexpr std::array colours{"#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"};

std::string line_types() {
  constexpr int dashes[] = {1, 2, 4};
  std::string text;
  int number = 0;
  for (const int dash : dashes) {
    for (const char* colour : colours)
      text += fmt::format("set linetype {} lc rgb '{}' dt {}\n", ++number, colour, dash);
  }
  return text + fmt::format("set linetype cycle {}\n", number);
}

/// One picture: its data, and its panels in rows.
std::string page_of(const std::vector<Panel>& panels) {
  std::string text;
  for (std::size_t p = 0; p < panels.size(); ++p) {
    text += match(panels[p], [&](const auto& panel) { return data_of(panel, static_cast<int>(p)); });
  }
  const Layout layout = layout_of(panels);
  if (panels.size() > 1) text += fmt::format("set multiplot layout {},{}\n", layout.rows, layout.columns);
  for (std::size_t p = 0; p < panels.size(); ++p) {
    text += match(panels[p], [&](const auto& panel) { return plot_of(panel, static_cast<int>(p), layout); });
  }
  return text + (panels.size() > 1 ? "unset multiplot\n" : "");
}

/// Script for one page, or for the pages of a film.
std::string script_for(const std::vector<std::vector<Panel>>& pages, const std::string& terminal,
                       const fs::path& output) {
  std::string text =
      fmt::format("set terminal {}\nset output {}\nset encoding utf8\n", terminal, quoted(output.string()));
  text += line_types() + "set tics nomirror\n";
  for (const std::vector<Panel>& page : pages) text += page_of(page);
  return text + "unset output\n";
}

struct Format {
  std::string extension, terminal;
};

/// Panels as they are drawn.
std::vector<Panel> drawn(const std::vector<Panel>& panels) {
  std::vector<Panel> all;
  for (const Panel& panel : panels) {
    all.push_back(match(
        panel, [](const LinePanel& lines) { return Panel(with_readable_values(lines)); },
        [](const MapPanel& map) { return Panel(with_readable_values(with_pixels(map))); }));
  }
  return all;
}

/// Runs gnuplot for the pages and returns the final file name; "" after a diagnostic.
std::string draw_as(const Format& format, const fs::path& stem, const std::vector<std::vector<Panel>>& pages,
                    const TemporaryFolder& folder, DiagnosticSink& sink) {
  const fs::path drawn = folder.path() / ("picture" + format.extension);
  const fs::path script = folder.path() / ("picture" + format.extension + ".gp");
  if (!files::write_file(script, script_for(pages, format.terminal, drawn), sink)) return "";
  const fs::path target = stem.string() + format.extension;
  if (!run_process({"gnuplot", script.string()}).succeeded()) {
    sink.report("cannot-write", {}, {target.string(), "gnuplot failed"});
    return "";
  }
  const std::optional<std::string> bytes = files::read_file(drawn, {}, sink);
  return bytes && files::write_file(target, *bytes, sink) ? target.string() : "";
}

std::vector<std::string> draw_all(const std::vector<Format>& formats, const fs::path& stem,
                                  const std::vector<std::vector<Panel>>& pages, DiagnosticSink& sink) {
  std::vector<std::string> files;
  if (pages.empty() || pages.front().empty()) return files;
  const TemporaryFolder folder;
  if (folder.path().empty()) {
    sink.report("cannot-write", {}, {stem.string(), "no temporary folder could be made"});
    return files;
  }
  for (const Format& format : formats) {
    const std::string file = draw_as(format, stem, pages, folder, sink);
    if (file.empty()) return files;
    files.push_back(file);
  }
  return files;
}

std::string size_of(const std::vector<Panel>& panels, int scale) {
  const Layout layout = layout_of(panels);
  return fmt::format("size {},{}", scale * layout.columns * layout.width, scale * layout.rows * layout.height);
}

Format png_of(const std::vector<Panel>& panels) {
  return {
      ".png",
      fmt::format("pngcairo {} font 'DejaVu Sans,12' fontscale {} linewidth {} pointscale {} background rgb 'white'",
                  size_of(panels, png_scale), png_scale, png_scale, png_scale)};
}

constexpr int hundredths_a_page = 8;

/// Writes `stem`.mp4: frames as PNG, encoded by ffmpeg. H.264 wants even numbers of pixels, which PNGs have.
std::vector<std::string> encode(const fs::path& stem, const std::vector<std::vector<Panel>>& frames,
                                DiagnosticSink& sink) {
  const TemporaryFolder folder;
  const fs::path target = stem.string() + ".mp4";
  const auto fail = [&](const std::string& why) {
    sink.report("cannot-write", {}, {target.string(), why});
    return std::vector<std::string>{};
  };
  if (folder.path().empty()) return fail("no temporary folder could be made");
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const fs::path frame = folder.path() / fmt::format("frame_{:06}", k);
    if (draw_as(png_of(frames[k]), frame, {frames[k]}, folder, sink).empty()) return {};
  }
  const fs::path film = folder.path() / "film.mp4";
  const std::string rate = fmt::format("100/{}", hundredths_a_page);
  if (!run_process({"ffmpeg", "-loglevel", "error", "-y", "-framerate", rate, "-i",
                    (folder.path() / "frame_%06d.png").string(), "-pix_fmt", "yuv420p", film.string()})
           .succeeded())
    return fail("ffmpeg failed");
  const std::optional<std::string> bytes = files::read_file(film, {}, sink);
  if (!bytes || !files::write_file(target, *bytes, sink)) return {};
  return {target.string()};
}

}  // namespace

Colours colours_of(const std::optional<ValueRange>& range) {
  double low = range ? range->low : INFINITY, high = range ? range->high : -INFINITY;
  if (!(high - low > 1e-7 * std::max(std::abs(low), std::abs(high)))) {  // constant or no values
    const double middle = std::isfinite(low) ? low : 0, half = middle == 0 ? 1 : std::abs(middle) / 10;
    low = middle - half;
    high = middle + half;
  }
  constexpr double little = 0.1;
  const double bound = std::max(std::abs(low), std::abs(high));
  const bool is_signed = std::min(-low, high) > little * bound;
  return is_signed ? Colours{{-bound, bound}, true} : Colours{{low, high}, false};
}

std::string colour_of_curve(std::size_t number) { return colours[number % colours.size()]; }

std::optional<ValueRange> range_of(const std::vector<double>& values) {
  ValueRange range{INFINITY, -INFINITY};
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    range.low = std::min(range.low, value);
    range.high = std::max(range.high, value);
  }
  return range.low <= range.high ? std::optional(range) : std::nullopt;
}

bool spans_decades(const std::vector<Curve>& curves) {
  constexpr double decades = 1e3;
  std::vector<double> ends;
  for (const Curve& curve : curves) {
    if (const std::optional<ValueRange> range = range_of(curve.y)) ends.insert(ends.end(), {range->low, range->high});
  }
  const std::optional<ValueRange> range = range_of(ends);
  return range && range->low > 0 && range->high > decades * range->low;
}

std::vector<double> plane_of(const std::vector<double>& values, const std::array<std::int64_t, 3>& cells, int across,
                             std::int64_t index) {
  const std::array<std::int64_t, 3> stride{1, cells[0], cells[0] * cells[1]};
  const auto a = static_cast<std::size_t>(across == 0 ? 1 : 0), b = static_cast<std::size_t>(across == 2 ? 1 : 2);
  std::vector<double> plane;
  for (std::int64_t j = 0; j < cells[b]; ++j) {
    for (std::int64_t i = 0; i < cells[a]; ++i)
      plane.push_back(values[static_cast<std::size_t>(i * stride[a] + j * stride[b] +
                                                      index * stride[static_cast<std::size_t>(across)])]);
  }
  return plane;
}

void share_range(std::span<Panel> panels) {
  std::vector<double> ends;
  for (const Panel& panel : panels) {
    const MapPanel* map = std::get_if<MapPanel>(&panel);
    const std::optional<ValueRange> range = map == nullptr ? std::nullopt : range_of(map->values);
    if (range) ends.insert(ends.end(), {range->low, range->high});
  }
  for (Panel& panel : panels) {
    if (MapPanel* map = std::get_if<MapPanel>(&panel)) map->range = range_of(ends);
  }
}

bool have_gnuplot() {
  static const bool found = run_process({"gnuplot", "--version"}).succeeded();
  return found;
}

std::vector<std::string> draw(const fs::path& stem, const std::vector<Panel>& given, DiagnosticSink& sink,
                              Formats formats) {
  if (!have_gnuplot()) return {};
  const std::vector<Panel> panels = drawn(given);
  std::vector<Format> wanted{png_of(panels)};
  const std::string svg =
      fmt::format("svg {} dynamic font 'DejaVu Sans,15' background rgb 'white'", size_of(panels, 1));
  if (formats == Formats::svg_and_png) wanted.insert(wanted.begin(), {".svg", svg});
  return draw_all(wanted, stem, {panels}, sink);
}

std::vector<std::string> draw_film(const fs::path& stem, const std::vector<std::vector<Panel>>& pages,
                                   DiagnosticSink& sink) {
  if (pages.empty() || !have_gnuplot()) return {};
  std::vector<std::vector<Panel>> frames;
  for (const std::vector<Panel>& page : pages) frames.push_back(drawn(page));
  if (run_process({"ffmpeg", "-version"}).succeeded()) return encode(stem, frames, sink);
  const std::string size = size_of(frames.front(), 1);
  return draw_all({{".gif", fmt::format("gif animate delay {} loop 0 {}", hundredths_a_page, size)}}, stem, frames,
                  sink);
}

}  // namespace dpde::plot
