// SPDX-License-Identifier: Apache-2.0
#include "plot/text_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace dpde::plot {

namespace {

struct Bounds {
  double low = INFINITY, high = -INFINITY;
  void include(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  void widen() {
    if (!(low <= high)) low = 0, high = 1;
    if (low == high) low -= 1, high += 1;
  }
};

/// A raster of dots, printed as characters of `across` x `down` dots.
class Canvas {
 public:
  Canvas(int width, int height, bool unicode)
      : unicode_(unicode),
        across_(unicode ? 2 : 1),
        down_(unicode ? 4 : 1),
        width_(width),
        height_(height),
        dots_(std::size_t(width * across_) * std::size_t(height * down_), ' ') {}

  int columns() const { return width_ * across_; }
  int rows() const { return height_ * down_; }
  void set(int column, int row, char mark) {
    if (column >= 0 && column < columns() && row >= 0 && row < rows())
      dots_[std::size_t(row) * columns() + column] = mark;
  }
  void line(int c0, int r0, int c1, int r1, char mark) {
    const int steps = std::max({std::abs(c1 - c0), std::abs(r1 - r0), 1});
    for (int s = 0; s <= steps; ++s) {
      set(c0 + static_cast<int>(std::lround(double(c1 - c0) * s / steps)),
          r0 + static_cast<int>(std::lround(double(r1 - r0) * s / steps)), mark);
    }
  }
  std::string text_line(int line) const {
    std::string text;
    for (int c = 0; c < width_; ++c)
      text += unicode_ ? braille(c, line) : std::string(1, dots_[std::size_t(line) * width_ + c]);
    return text;
  }

 private:
  std::string braille(int character, int line) const {
    constexpr int bit[4][2] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
    int mask = 0;
    for (int r = 0; r < 4; ++r) {
      for (int c = 0; c < 2; ++c) {
        if (dots_[std::size_t(line * 4 + r) * columns() + character * 2 + c] != ' ') mask |= bit[r][c];
      }
    }
    if (mask == 0) return " ";
    return {static_cast<char>(0xE2), static_cast<char>(0xA0 | (mask >> 6)), static_cast<char>(0x80 | (mask & 0x3F))};
  }

  bool unicode_;
  int across_, down_, width_, height_;
  std::vector<char> dots_;
};

double vertical(const LinePanel& panel, double y) { return panel.log_y ? std::log10(y) : y; }

}  // namespace

std::string text_plot(const LinePanel& panel, bool unicode, int width, int height) {
  Bounds xs, ys;
  for (const Curve& curve : panel.curves) {
    for (const double x : curve.x) xs.include(x);
    for (const double y : curve.y) ys.include(vertical(panel, y));
  }
  xs.widen();
  ys.widen();
  Canvas canvas(width, height, unicode);
  for (std::size_t c = panel.curves.size(); c-- > 0;) {
    const Curve& curve = panel.curves[c];
    int last_column = -1, last_row = -1;
    for (std::size_t i = 0; i < curve.y.size(); ++i) {
      const double y = vertical(panel, curve.y[i]);
      if (!std::isfinite(y)) {
        last_column = -1;
        continue;
      }
      const int column =
          static_cast<int>(std::lround((curve.x[i] - xs.low) / (xs.high - xs.low) * (canvas.columns() - 1)));
      const int row = static_cast<int>(std::lround((ys.high - y) / (ys.high - ys.low) * (canvas.rows() - 1)));
      const char mark = c == 0 ? '*' : 'o';
      if (last_column >= 0 && !curve.points) canvas.line(last_column, last_row, column, row, mark);
      canvas.set(column, row, mark);
      last_column = column;
      last_row = row;
    }
  }
  const auto label = [&](double v) { return fmt::format("{:>10.4g}", panel.log_y ? std::pow(10.0, v) : v); };
  const char* bar = unicode ? "\u2502" : "|";
  std::string text = panel.title.empty() ? "" : fmt::format("{:>10} {}\n", "", panel.title);
  for (int line = 0; line < height; ++line) {
    const double here = ys.high - (ys.high - ys.low) * line / (height - 1);
    text += (line == 0 || line == height - 1 || line == height / 2 ? label(here) : std::string(10, ' ')) + " " + bar +
            canvas.text_line(line) + "\n";
  }
  text += std::string(11, ' ') + (unicode ? "\u2514" : "+");
  for (int c = 0; c < width; ++c) text += unicode ? "\u2500" : "-";
  text += fmt::format("\n{:>11} {:<10.4g}{:^{}}{:>10.4g}\n", "", xs.low, panel.x_label, width - 20, xs.high);
  return text;
}

bool terminal_is_utf8() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    const char* value = std::getenv(name);
    if (value == nullptr || *value == '\0') continue;
    return std::strstr(value, "UTF-8") != nullptr || std::strstr(value, "utf8") != nullptr;
  }
  return false;
}

}  // namespace dpde::plot
