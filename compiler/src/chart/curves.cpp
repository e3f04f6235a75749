// SPDX-License-Identifier: Apache-2.0
#include "chart/curves.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace dpde::chart {

namespace {

constexpr double narrow = 0.25;     // relative to the median
constexpr double busy_part = 0.25;  // share of the points
constexpr int resamplings = 1000;
constexpr std::size_t fewest_samples = 3;
constexpr double tail = 0.025;  // probability on each side of the interval

/// Seconds at this error, interpolated on a hull; nullopt outside its range.
std::optional<double> seconds_at(const std::vector<Mark>& hull, double error) {
  for (std::size_t i = 0; i + 1 < hull.size(); ++i) {
    const Measured &a = hull[i].at, &b = hull[i + 1].at;
    if (error > a.error || error < b.error) continue;
    const double part = std::log(error / a.error) / std::log(b.error / a.error);
    return a.seconds * std::pow(b.seconds / a.seconds, part);
  }
  return std::nullopt;
}

/// Bootstrap: the same points with medians of timings drawn with replacement.
std::vector<Mark> resampled(std::vector<Mark> hull, std::mt19937_64& random) {
  for (Mark& mark : hull) {
    const std::vector<double>& samples = mark.at.samples;
    if (samples.empty()) continue;
    std::vector<double> drawn(samples.size());
    for (double& value : drawn) value = samples[random() % samples.size()];
    std::ranges::nth_element(drawn, drawn.begin() + std::ssize(drawn) / 2);
    mark.at.seconds = drawn[drawn.size() / 2];
  }
  return hull;
}

/// Requires that both hulls reach the error. The seed is fixed, so the same timings give the same interval.
void add_interval(const std::vector<Mark>& base, const std::vector<Mark>& hull, SpeedUp& speed_up) {
  const auto has_few = [](const Mark& mark) { return mark.at.samples.size() < fewest_samples; };
  if (std::ranges::any_of(base, has_few) || std::ranges::any_of(hull, has_few)) return;
  std::mt19937_64 random(1);
  std::vector<double> ratios;
  for (int i = 0; i < resamplings; ++i) {
    const std::vector<Mark> slow = resampled(base, random), fast = resampled(hull, random);
    ratios.push_back(*seconds_at(slow, speed_up.error) / *seconds_at(fast, speed_up.error));
  }
  std::ranges::sort(ratios);
  speed_up.low = ratios[static_cast<std::size_t>(tail * resamplings)];
  speed_up.high = ratios[static_cast<std::size_t>((1 - tail) * resamplings)];
}

}  // namespace

std::vector<MethodMarks> marks_of(const std::vector<Point>& points, ChartOf what) {
  std::vector<MethodMarks> methods;
  for (const Point& point : points) {
    const std::string name = method_text(point.variant);
    auto known = std::ranges::find(methods, name, &MethodMarks::name);
    if (known == methods.end()) known = methods.insert(methods.end(), {name, {}});
    if (what == ChartOf::states) known->marks.push_back({point, is_complete(point), &point});
    if (what == ChartOf::gradient && point.gradient)
      known->marks.push_back({*point.gradient, is_complete(*point.gradient), &point});
    if (what == ChartOf::gradient && !point.gradient_failure.empty()) known->marks.push_back({{}, false, &point});
  }
  std::erase_if(methods, [](const MethodMarks& method) { return method.marks.empty(); });
  return methods;
}

std::vector<Mark> unbeaten_of(const MethodMarks& method) {
  std::vector<Mark> hull;
  for (const Mark& mark : method.marks) {
    const auto is_better = [&](const Mark& other) { return other.is_drawn() && beats(other.at, mark.at); };
    if (mark.is_drawn() && std::ranges::none_of(method.marks, is_better)) hull.push_back(mark);
  }
  std::ranges::sort(hull, std::greater(), [](const Mark& mark) { return mark.at.error; });
  return hull;
}

std::vector<Mark> hull_of(const MethodMarks& method) {
  std::vector<Mark> hull;
  for (const Mark& mark : unbeaten_of(method)) {
    const auto is_beyond_line = [&] {  // whether the last one is above the line from the one before to this one
      const Measured &a = hull[hull.size() - 2].at, &b = hull.back().at, &c = mark.at;
      return std::log(b.seconds / a.seconds) * std::log(a.error / c.error) >=
             std::log(c.seconds / a.seconds) * std::log(a.error / b.error);
    };
    while (hull.size() > 1 && mark.at.error > 0 && is_beyond_line()) hull.pop_back();
    hull.push_back(mark);
  }
  return hull;
}

double slope_of(std::vector<Mark> points, double uncertainty) {
  std::erase_if(points, [&](const Mark& mark) { return !(mark.at.error > uncertainty); });
  const auto n = static_cast<double>(points.size());
  double mean_x = 0, mean_y = 0, products = 0, squares = 0;
  for (const Mark& mark : points) {
    mean_x -= std::log(mark.at.error) / n;
    mean_y += std::log(mark.at.seconds) / n;
  }
  for (const Mark& mark : points) {
    const double x = -std::log(mark.at.error) - mean_x;
    products += x * (std::log(mark.at.seconds) - mean_y);
    squares += x * x;
  }
  return points.size() > 1 && squares > 0 ? products / squares : NAN;
}

std::vector<SpeedUp> speed_ups(const std::vector<MethodMarks>& methods) {
  std::vector<SpeedUp> result;
  const std::vector<Mark> base = methods.empty() ? std::vector<Mark>() : hull_of(methods.front());
  for (std::size_t m = 1; m < methods.size() && base.size() > 1; ++m) {
    const std::vector<Mark> hull = hull_of(methods[m]);
    if (hull.size() < 2) continue;
    const double high = std::min(base.front().at.error, hull.front().at.error);
    const double low = std::max(base.back().at.error, hull.back().at.error);
    SpeedUp speed_up{methods[m].name};
    const double at = std::sqrt(high * low);
    const std::optional<double> slow = seconds_at(base, at), fast = seconds_at(hull, at);
    if (low < high && slow && fast) {
      speed_up.error = at;
      speed_up.ratio = *slow / *fast;
      add_interval(base, hull, speed_up);
    }
    result.push_back(speed_up);
  }
  return result;
}

bool is_wide(const Measured& measured) {
  return measured.high_quartile - measured.low_quartile > narrow * measured.seconds;
}

bool is_machine_busy(const std::vector<MethodMarks>& methods) {
  int all = 0, wide = 0;
  for (const MethodMarks& method : methods) {
    for (const Mark& mark : method.marks) {
      if (!mark.is_complete) continue;
      ++all;
      wide += is_wide(mark.at) ? 1 : 0;
    }
  }
  return wide > busy_part * all;
}

}  // namespace dpde::chart
