// SPDX-License-Identifier: Apache-2.0
#include "chart_picture.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace dpde::tools {

namespace {

/// Of all that is drawn.
struct Extent {
  double slowest = 0, fastest = INFINITY, worst = 0, least_memory = INFINITY, most_memory = 0;
};

Extent extent_of(const std::vector<MethodMarks>& methods) {
  Extent extent;
  for (const MethodMarks& method : methods) {
    for (const Mark& mark : method.marks) {
      if (!mark.is_drawn()) continue;
      extent.slowest = std::max(extent.slowest, mark.at.seconds);
      extent.fastest = std::min(extent.fastest, mark.at.seconds);
      extent.worst = std::max(extent.worst, mark.at.error);
      extent.least_memory = std::min(extent.least_memory, mark.at.memory_bytes);
      extent.most_memory = std::max(extent.most_memory, mark.at.memory_bytes);
    }
  }
  return extent;
}

/// From 0.5 to 1.5, by the logarithm.
double size_of(const Mark& mark, const Extent& extent) {
  if (!(extent.most_memory > extent.least_memory) || !(extent.least_memory > 0)) return 0.8;
  return 0.5 +
         std::log(mark.at.memory_bytes / extent.least_memory) / std::log(extent.most_memory / extent.least_memory);
}

Curve method_curve(const MethodMarks& method, const Extent& extent) {
  Curve curve{method.name, {}, {}};
  for (const Mark& mark : hull_of(method)) {
    curve.x.push_back(mark.at.error);
    curve.y.push_back(mark.at.seconds);
    curve.low.push_back(mark.at.low_quartile);
    curve.high.push_back(mark.at.high_quartile);
    curve.sizes.push_back(size_of(mark, extent));
  }
  return curve;
}

Curve marks_where(const char* title, Symbol symbol, const std::vector<MethodMarks>& methods,
                  const std::function<bool(const MethodMarks&, const Mark&)>& is_meant) {
  Curve curve{title, {}, {}, true};
  curve.symbol = symbol;
  for (const MethodMarks& method : methods) {
    for (const Mark& mark : method.marks) {
      if (!mark.is_drawn() || !is_meant(method, mark)) continue;
      curve.x.push_back(mark.at.error);
      curve.y.push_back(mark.at.seconds);
    }
  }
  return curve;
}

/// They have no error: beside the worst one that is.
Curve unstable_of(const std::vector<MethodMarks>& methods, const Extent& extent) {
  Curve curve{"unstable (not run, or blew up)", {}, {}, true};
  curve.symbol = Symbol::cross;
  for (const MethodMarks& method : methods) {
    for (const Mark& mark : method.marks) {
      if (!mark.point->is_unstable || !(extent.worst > 0)) continue;
      const double height = 0.1 * (1 + std::ssize(curve.x) % 8);
      curve.x.push_back(10 * extent.worst);
      curve.y.push_back(extent.fastest * std::pow(extent.slowest / extent.fastest, height));
    }
  }
  return curve;
}

bool is_beaten(const MethodMarks& method, const Mark& mark) {
  return std::ranges::any_of(method.marks,
                             [&](const Mark& other) { return other.is_drawn() && beats(other.at, mark.at); });
}

}  // namespace

LinePanel panel_of(const ChartText& text, const std::vector<MethodMarks>& methods, double uncertainty,
                   double tolerance) {
  LinePanel panel{text.title, text.x_label, text.y_label, true, true, {}, {}, true};
  const Extent extent = extent_of(methods);
  const auto add = [&](Curve curve) {
    if (!curve.x.empty()) panel.curves.push_back(std::move(curve));
  };
  for (const MethodMarks& method : methods) add(method_curve(method, extent));
  add(marks_where("beaten by the same method", Symbol::dot, methods, is_beaten));
  add(marks_where("nothing beats it", Symbol::ring, methods,
                  [](const MethodMarks&, const Mark& mark) { return mark.at.is_pareto; }));
  add(marks_where("below the error of the reference", Symbol::square, methods,
                  [&](const MethodMarks&, const Mark& mark) { return mark.at.error < uncertainty; }));
  add(unstable_of(methods, extent));
  const auto wall = [&](const char* title, double error) {
    Curve curve{title, {error, error}, {extent.fastest, extent.slowest}};
    curve.colour = "#999999";
    if (error > 0 && extent.slowest > 0) add(std::move(curve));
  };
  wall("error of the reference", uncertainty);
  wall("tolerance", tolerance);
  return panel;
}

}  // namespace dpde::tools
