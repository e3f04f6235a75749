// SPDX-License-Identifier: Apache-2.0
#include "plot/chart_panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "support/names/number_text.h"

namespace dpde::plot {

namespace {

/// Range of all drawn marks.
struct Extent {
  double slowest = 0, fastest = INFINITY, worst = 0, least_memory = INFINITY, most_memory = 0;
};

Extent extent_of(const std::vector<chart::MethodMarks>& methods) {
  Extent extent;
  for (const chart::MethodMarks& method : methods) {
    for (const chart::Mark& mark : method.marks) {
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

/// Size of a mark from 0.5 to 1.5, linear in the logarithm of its memory.
double size_of(const chart::Mark& mark, const Extent& extent) {
  if (!(extent.most_memory > extent.least_memory) || !(extent.least_memory > 0)) return 0.8;
  return 0.5 +
         std::log(mark.at.memory_bytes / extent.least_memory) / std::log(extent.most_memory / extent.least_memory);
}

Curve method_curve(const chart::MethodMarks& method, const Extent& extent, double uncertainty) {
  const std::vector<chart::Mark> unbeaten = chart::unbeaten_of(method);
  const double slope = chart::slope_of(unbeaten, uncertainty);
  Curve curve{method.name + (std::isnan(slope) ? "" : fmt::format(" (error^-{:.2f})", slope)), {}, {}};
  for (const chart::Mark& mark : unbeaten) {
    curve.x.push_back(mark.at.error);
    curve.y.push_back(mark.at.seconds);
    curve.low.push_back(mark.at.low_quartile);
    curve.high.push_back(mark.at.high_quartile);
    curve.sizes.push_back(size_of(mark, extent));
  }
  return curve;
}

Curve marks_where(const char* title, Symbol symbol, const std::vector<chart::MethodMarks>& methods,
                  const std::function<bool(const chart::MethodMarks&, const chart::Mark&)>& is_meant) {
  Curve curve{title, {}, {}, true};
  curve.symbol = symbol;
  for (const chart::MethodMarks& method : methods) {
    for (const chart::Mark& mark : method.marks) {
      if (!mark.is_drawn() || !is_meant(method, mark)) continue;
      curve.x.push_back(mark.at.error);
      curve.y.push_back(mark.at.seconds);
    }
  }
  return curve;
}

/// Failed points have no error: drawn at the right of the largest error, one below the other.
Curve failures_of(const char* title, const std::function<bool(const chart::Mark&)>& is_meant,
                  const std::vector<chart::MethodMarks>& methods, const Extent& extent, int& drawn) {
  Curve curve{title, {}, {}, true};
  curve.symbol = Symbol::cross;
  for (const chart::MethodMarks& method : methods) {
    for (const chart::Mark& mark : method.marks) {
      if (!is_meant(mark) || !(extent.worst > 0)) continue;
      const double height = 0.1 * (1 + drawn++ % 8);
      curve.x.push_back(10 * extent.worst);
      curve.y.push_back(extent.fastest * std::pow(extent.slowest / extent.fastest, height));
    }
  }
  return curve;
}

bool is_beaten(const chart::MethodMarks& method, const chart::Mark& mark) {
  return std::ranges::any_of(
      method.marks, [&](const chart::Mark& other) { return other.is_drawn() && chart::beats(other.at, mark.at); });
}

}  // namespace

LinePanel chart_panel(const ChartText& text, const std::vector<chart::MethodMarks>& methods, double uncertainty,
                      double tolerance) {
  LinePanel panel{text.title, text.x_label, text.y_label};
  panel.log_x = panel.log_y = panel.names_below = true;
  const Extent extent = extent_of(methods);
  panel.corner = text.machine;
  if (extent.least_memory < extent.most_memory)
    panel.corner +=
        fmt::format("; marks by memory, {} to {}", human_bytes(extent.least_memory), human_bytes(extent.most_memory));
  const auto add = [&](Curve curve) {
    if (!curve.x.empty()) panel.curves.push_back(std::move(curve));
  };
  for (const chart::MethodMarks& method : methods) add(method_curve(method, extent, uncertainty));
  add(marks_where("beaten by the same method", Symbol::dot, methods, is_beaten));
  add(marks_where("nothing beats it", Symbol::ring, methods,
                  [](const chart::MethodMarks&, const chart::Mark& mark) { return mark.at.is_pareto; }));
  add(marks_where("below the error of the reference", Symbol::square, methods,
                  [&](const chart::MethodMarks&, const chart::Mark& mark) { return mark.at.error < uncertainty; }));
  add(marks_where("above the largest stable step", Symbol::cross, methods,
                  [](const chart::MethodMarks&, const chart::Mark& mark) { return mark.point->is_above_limit; }));
  int drawn = 0;
  for (const auto& [outcome, title] : {std::pair{chart::Outcome::above_limit, "not run: above the largest stable step"},
                                       {chart::Outcome::never_stable, "not run: unstable at every step"},
                                       {chart::Outcome::blew_up, "blew up"},
                                       {chart::Outcome::failed, "failed"}}) {
    const auto is_it = [outcome](const chart::Mark& mark) { return mark.point->outcome == outcome; };
    add(failures_of(title, is_it, methods, extent, drawn));
  }
  const auto has_no_gradient = [](const chart::Mark& mark) {
    return !mark.is_complete && mark.point->failure.empty() && !mark.point->gradient_failure.empty();
  };
  add(failures_of("it ran, but its gradient failed", has_no_gradient, methods, extent, drawn));
  const auto wall = [&](const char* title, double error) {
    Curve curve{title, {error, error}, {extent.fastest, extent.slowest}};
    curve.colour = "#999999";
    if (error > 0 && extent.slowest > 0) add(std::move(curve));
  };
  panel.wall = uncertainty;
  wall("error of the reference", uncertainty);
  wall("tolerance", tolerance);
  return panel;
}

}  // namespace dpde::plot
