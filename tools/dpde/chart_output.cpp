// SPDX-License-Identifier: Apache-2.0
#include "chart_output.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <thread>

#include "files/evaluation_log.h"
#include "files/files.h"
#include "picture.h"
#include "scene_output.h"

namespace dpde::tools {

namespace {

namespace fs = std::filesystem;
using chart::Point;

constexpr double narrow = 0.25;  // quartiles further apart than this part of the median are a busy machine's

/// On logarithmic axes: what has no error is on none.
bool is_drawn(const Point& point) { return is_complete(point) && point.error > 0; }

Json variant_json(const chart::Variant& variant) {
  Json json = Json::object();
  for (const auto& [key, value] : variant.method) json[key] = value;
  for (const auto& [key, value] : variant.resolution) json[key] = value;
  return json;
}

Json point_json(const Point& point) {
  return {{"variant", variant_json(point.variant)},
          {"cells", point.cells},
          {"step", point.step},
          {"steps", point.steps},
          {"error", point.failure.empty() ? json_number(point.error) : Json(nullptr)},
          {"errors", point.errors},
          {"wall_s", point.seconds > 0 ? Json(point.seconds) : Json(nullptr)},
          {"wall_s_quartiles", {point.low_quartile, point.high_quartile}},
          {"compile_s", point.compile_seconds},
          {"memory_bytes", point.memory_bytes},
          {"max_step", point.largest_step > 0 ? Json(point.largest_step) : Json(nullptr)},
          {"stable", !point.is_unstable},
          {"fits", !point.does_not_fit},
          {"failure", point.failure.empty() ? Json(nullptr) : Json(point.failure)},
          {"pareto", point.is_pareto}};
}

Point point_from(const Json& json) {
  Point point;
  point.failure = json.at("failure").is_null() ? "" : json.at("failure").get<std::string>();
  point.is_unstable = !json.at("stable").get<bool>();
  point.does_not_fit = !json.at("fits").get<bool>();
  point.cells = json.at("cells").get<std::vector<int>>();
  point.step = json.at("step");
  point.steps = json.at("steps");
  point.largest_step = json.at("max_step").is_null() ? 0 : json.at("max_step").get<double>();
  for (const auto& [name, error] : json.at("errors").items())
    point.errors[name] = error.is_number() ? error.get<double>() : NAN;
  point.error = json.at("error").is_number() ? json.at("error").get<double>() : NAN;
  point.seconds = json.at("wall_s").is_null() ? 0 : json.at("wall_s").get<double>();
  point.low_quartile = json.at("wall_s_quartiles")[0];
  point.high_quartile = json.at("wall_s_quartiles")[1];
  point.compile_seconds = json.at("compile_s");
  point.memory_bytes = json.at("memory_bytes");
  return point;
}

std::string cells_of(const Point& point) {
  return point.cells.empty() ? std::string("-") : fmt::format("{}", fmt::join(point.cells, "x"));
}

}  // namespace

bool ChartFile::open(const std::string& folder, const std::string& scene, bool resume, DiagnosticSink& sink) {
  path_ = fs::path(folder) / (scene + "_chart_points.json");
  if (!resume || !fs::exists(path_)) return true;
  const std::optional<std::string> text = files::read_file(path_, {}, sink);
  if (!text) return false;
  const Json json = parse_json(*text);
  if (!json.is_object()) {
    sink.report("cannot-read", {}, {path_.string(), "it holds no points of a chart"},
                "leave out --resume to begin anew");
    return false;
  }
  try {
    for (const auto& [key, point] : json.items()) {
      point_from(point);
      known_[key] = point;
    }
  } catch (const std::exception&) {
    known_.clear();
    sink.report("cannot-read", {}, {path_.string(), "it holds no points of a chart"},
                "leave out --resume to begin anew");
  }
  return !sink.has_errors();
}

std::string ChartFile::key_of(const Job& job, const chart::Entry& entry, const std::string& reference) {
  const CommonOptions& options = job.options();
  const std::string_view text = job.source().text();
  return fmt::format("{:016x} {} {} {} {} {} {} {} {} {}", files::hash_bytes(text.data(), text.size()), version,
                     options.name, options.scheme, options.backend, thread_count(options), fmt::join(options.set, " "),
                     reference, entry.fraction, variant_json(entry.variant).dump());
}

std::optional<Point> ChartFile::find(const std::string& key, const chart::Entry& entry) const {
  const auto known = known_.find(key);
  if (known == known_.end()) return std::nullopt;
  Point point = point_from(known->second);
  point.variant = entry.variant;
  if (point.step > 0) point.variant.resolution["step"] = fmt::format("{}", point.step);
  return point;
}

void ChartFile::add(const std::string& key, const Point& point) { known_[key] = point_json(point); }

bool ChartFile::save(DiagnosticSink& sink) const {
  Json json = Json::object();
  for (const auto& [key, point] : known_) json[key] = point;
  return files::write_file(path_, json.dump(1) + "\n", sink);
}

namespace {

/// Points of one method, from few cells to many.
struct Method {
  std::string name;
  std::vector<Point> points;
};

std::vector<Method> methods_of(const std::vector<Point>& points) {
  std::vector<Method> methods;
  for (const Point& point : points) {
    const std::string name = chart::method_text(point.variant);
    auto known = std::ranges::find(methods, name, &Method::name);
    if (known == methods.end()) known = methods.insert(methods.end(), {name, {}});
    known->points.push_back(point);
  }
  return methods;
}

/// Of a method's complete points those that none of its own beats: its curve.
std::vector<Point> hull_of(const Method& method) {
  std::vector<Point> hull;
  for (const Point& point : method.points) {
    const auto is_better = [&](const Point& other) { return is_drawn(other) && beats(other, point); };
    if (is_drawn(point) && std::ranges::none_of(method.points, is_better)) hull.push_back(point);
  }
  std::ranges::sort(hull, std::greater(), &Point::error);
  return hull;
}

/// The slope of the curve: seconds go as error^-slope. NaN of fewer than two points.
double slope_of(const std::vector<Point>& hull) {
  if (hull.size() < 2) return NAN;
  return std::log(hull.back().seconds / hull.front().seconds) / std::log(hull.front().error / hull.back().error);
}

/// Seconds at this error on a hull, by straight lines between its points in logarithms; nullopt beyond its ends.
std::optional<double> seconds_at(const std::vector<Point>& hull, double error) {
  for (std::size_t i = 0; i + 1 < hull.size(); ++i) {
    if (error > hull[i].error || error < hull[i + 1].error) continue;
    const double part = std::log(error / hull[i].error) / std::log(hull[i + 1].error / hull[i].error);
    return hull[i].seconds * std::pow(hull[i + 1].seconds / hull[i].seconds, part);
  }
  return std::nullopt;
}

/// How much faster each method is than the first one, at the middle of the errors that both reach.
std::string speed_ups(const std::vector<Method>& methods, Json& result) {
  std::string text;
  result = Json::array();
  if (methods.empty()) return text;
  const std::vector<Point> base = hull_of(methods.front());
  for (std::size_t m = 1; m < methods.size() && base.size() > 1; ++m) {
    const std::vector<Point> hull = hull_of(methods[m]);
    if (hull.size() < 2) continue;
    const double high = std::min(base.front().error, hull.front().error),
                 low = std::max(base.back().error, hull.back().error);
    Json entry = {{"method", methods[m].name}, {"against", methods.front().name}};
    const double at = std::sqrt(high * low);
    const std::optional<double> slow = seconds_at(base, at), fast = seconds_at(hull, at);
    if (low < high && slow && fast) {
      entry["error"] = at;
      entry["ratio"] = *slow / *fast;
      text += fmt::format("  {}: {:.3g} times as fast at an error of {:.2g}\n", methods[m].name, *slow / *fast, at);
    } else {
      entry["error"] = entry["ratio"] = nullptr;
      text += fmt::format("  {}: no overlap of errors\n", methods[m].name);
    }
    result.push_back(entry);
  }
  if (!text.empty()) text = fmt::format("at equal accuracy, against {}:\n", methods.front().name) + text;
  return text;
}

std::string table_of(const std::vector<Method>& methods) {
  std::string text =
      fmt::format("{:>10} {:>11} {:>10} {:>11} {:>9}  \n", "cells", "step", "error", "s per unit", "order");
  for (const Method& method : methods) {
    const double slope = slope_of(hull_of(method));
    text += method.name + (std::isnan(slope) ? "" : fmt::format("  (seconds go as error^-{:.2f})", slope)) + "\n";
    for (const Point& point : method.points) {
      const Point* before = nullptr;
      if (!point.failure.empty()) {
        text +=
            fmt::format("{:>10} {:>11} {}\n", cells_of(point), point.step > 0 ? fmt::format("{:.4g}", point.step) : "-",
                        point.does_not_fit ? "left out: " + point.failure : point.failure);
        continue;
      }
      std::string order = "";
      for (const Point& other : method.points) {
        const bool has_ratio = is_drawn(other) && is_drawn(point) && !other.cells.empty() &&
                               std::abs(other.step / point.step * other.cells[0] / point.cells[0] - 1) < 0.2;
        if (has_ratio && other.cells[0] < point.cells[0]) before = &other;
      }
      if (before != nullptr && before->cells[0] < point.cells[0])
        order = fmt::format("{:.2f}", std::log(before->error / point.error) /
                                          std::log(static_cast<double>(point.cells[0]) / before->cells[0]));
      const bool is_wide = point.high_quartile - point.low_quartile > narrow * point.seconds;
      text +=
          fmt::format("{:>10} {:>11.4g} {:>10.3g} {:>11.3g} {:>9}  {}{}\n", cells_of(point), point.step, point.error,
                      point.seconds, order, point.is_pareto ? "*" : "", is_wide ? " (timings vary)" : "");
    }
  }
  return text + "* nothing else is both faster and more accurate\n";
}

LinePanel panel_of(const std::string& scene, const std::vector<Method>& methods, const std::vector<Point>& points,
                   double uncertainty, int threads) {
  LinePanel panel{fmt::format("{}: speed against accuracy ({} thread{})", scene, threads, threads == 1 ? "" : "s"),
                  "relative error (rms at the end)",
                  "seconds per unit of time",
                  true,
                  true,
                  {},
                  {},
                  true};
  double slowest = 0, fastest = INFINITY, worst = 0;
  for (const Point& point : points) {
    if (!is_drawn(point)) continue;
    slowest = std::max(slowest, point.seconds);
    fastest = std::min(fastest, point.seconds);
    worst = std::max(worst, point.error);
  }
  for (const Method& method : methods) {
    Curve curve{method.name, {}, {}};
    for (const Point& point : hull_of(method)) {
      curve.x.push_back(point.error);
      curve.y.push_back(point.seconds);
      curve.low.push_back(point.low_quartile);
      curve.high.push_back(point.high_quartile);
    }
    if (!curve.x.empty()) panel.curves.push_back(std::move(curve));
  }
  Curve others{"beaten by the same method", {}, {}, true}, unstable{"unstable (not run, or blew up)", {}, {}, true};
  for (const Method& method : methods) {
    const std::vector<Point> hull = hull_of(method);
    for (const Point& point : method.points) {
      const auto is_same = [&](const Point& p) { return p.error == point.error && p.seconds == point.seconds; };
      if (is_drawn(point) && std::ranges::none_of(hull, is_same)) {
        others.x.push_back(point.error);
        others.y.push_back(point.seconds);
      } else if (point.is_unstable && worst > 0) {
        unstable.x.push_back(10 * worst);
        unstable.y.push_back(fastest * std::pow(slowest / fastest, 0.1 * (1 + std::ssize(unstable.x) % 8)));
      }
    }
  }
  Curve wall{"error of the reference", {uncertainty, uncertainty}, {fastest, slowest}};
  if (!others.x.empty()) panel.curves.push_back(std::move(others));
  if (!unstable.x.empty()) panel.curves.push_back(std::move(unstable));
  if (uncertainty > 0 && slowest > 0) panel.curves.push_back(std::move(wall));
  return panel;
}

std::string csv_of(const std::vector<Point>& points) {
  std::string text =
      "method,cells,step,steps,error,wall_s,low_quartile,high_quartile,compile_s,memory_bytes,pareto,failure\n";
  for (const Point& point : points) {
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},\"{}\"\n", chart::method_text(point.variant), cells_of(point),
                        point.step, point.steps, point.failure.empty() ? fmt::format("{}", point.error) : "",
                        point.seconds, point.low_quartile, point.high_quartile, point.compile_seconds,
                        point.memory_bytes, point.is_pareto ? 1 : 0, point.failure);
  }
  return text;
}

}  // namespace

void write_chart(Job& job, const model::Problem& problem, const std::vector<Point>& points,
                 const chart::Reference& reference, int threads, Json& result) {
  const std::vector<Method> methods = methods_of(points);
  result["scene"] = problem.scene;
  result["reference"] = {{"text", reference.text()}, {"uncertainty", json_number(reference.uncertainty())}};
  result["threads"] = threads;
  result["machine"] = {{"cores", std::thread::hardware_concurrency()}};
  result["points"] = Json::array();
  for (const Point& point : points) result["points"].push_back(point_json(point));
  result["methods"] = Json::array();
  for (const Method& method : methods)
    result["methods"].push_back({{"name", method.name}, {"slope", json_number(slope_of(hull_of(method)))}});
  job.say(fmt::format(
      "{}: errors at t = {:.6g} against {}{}\n", problem.scene, problem.t_begin + problem.steps * problem.step,
      reference.text(),
      reference.uncertainty() > 0 ? fmt::format(", which is known to {:.2g}", reference.uncertainty()) : ""));
  job.say(table_of(methods));
  job.say(speed_ups(methods, result["speed_up"]));
  if (!job.options().out.empty()) {
    save_text(job, problem.scene + "_chart.csv", csv_of(points));
    save_picture(job, problem.scene + "_chart",
                 {panel_of(problem.scene, methods, points, reference.uncertainty(), threads)});
    save_text(job, problem.scene + "_chart.json", result.dump(1) + "\n");
  }
  result["files"] = job.files();
}

}  // namespace dpde::tools
