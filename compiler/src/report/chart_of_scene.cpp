// SPDX-License-Identifier: Apache-2.0
#include "report/chart_of_scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "chart/curves.h"
#include "chart/points_file.h"
#include "driver/memory/machine_speed.h"
#include "plot/chart_panel.h"

namespace dpde::report {

namespace {

using chart::Point;

std::string cells_of(const Point& point) {
  return point.cells.empty() ? std::string("-") : fmt::format("{}", fmt::join(point.cells, "x"));
}

/// "cg(1e-4)" if tolerances of solves are varied, else "".
std::string solve_of(const Point& point) {
  const auto solve = point.variant.resolution.find("solve");
  return solve == point.variant.resolution.end() ? "" : solve->second;
}
std::string solve_text(const Point& point) {
  const std::string solve = solve_of(point);
  return solve.empty() ? "" : " by " + solve;
}

/// Failure of its run, or of its gradient if it ran.
std::string failure_row(const Point& point) {
  const std::string& why = point.failure.empty() ? point.gradient_failure : point.failure;
  return fmt::format("{:>10} {:>11} {}{}\n", cells_of(point), point.step > 0 ? fmt::format("{:.4g}", point.step) : "-",
                     point.does_not_fit() ? "left out: " + why : why, solve_text(point));
}

/// Whether the points differ only in their cells: same fraction of the largest stable step, or steps proportional to
/// cell widths.
bool are_alike(const Point& coarse, const Point& fine) {
  const bool has_limits = coarse.largest_step > 0 && fine.largest_step > 0;
  const double as_long =
      has_limits ? fine.largest_step / coarse.largest_step : static_cast<double>(coarse.cells[0]) / fine.cells[0];
  return std::abs(coarse.step / fine.step * as_long - 1) < 0.2;
}

/// Order of convergence from the next coarser mark of this kind; "" if there is none.
std::string mark_order(const chart::MethodMarks& method, const chart::Mark& mark) {
  const chart::Mark* before = nullptr;
  for (const chart::Mark& other : method.marks) {
    if (!other.is_drawn() || !mark.is_drawn() || other.point->cells[0] >= mark.point->cells[0]) continue;
    if (solve_of(*other.point) != solve_of(*mark.point)) continue;
    if (are_alike(*other.point, *mark.point)) before = &other;
  }
  if (before == nullptr) return "";
  return fmt::format("{:.2f}", std::log(before->at.error / mark.at.error) /
                                   std::log(static_cast<double>(mark.point->cells[0]) / before->point->cells[0]));
}

std::string marks_table(const std::vector<chart::MethodMarks>& methods, double uncertainty, const char* seconds) {
  std::string text = fmt::format("{:>10} {:>11} {:>10} {:>11} {:>9}  \n", "cells", "step", "error", seconds, "order");
  for (const chart::MethodMarks& method : methods) {
    const double slope = chart::slope_of(chart::unbeaten_of(method), uncertainty);
    const bool has_no_limit = std::ranges::all_of(method.marks, [](const chart::Mark& mark) {
      return mark.point->failure.empty() && mark.point->largest_step == 0;
    });
    text += method.name + (std::isnan(slope) ? "" : fmt::format("  (seconds go as error^-{:.2f})", slope)) +
            (has_no_limit ? "  (no largest step is known: --vary step=... tries longer ones)" : "") + "\n";
    for (const chart::Mark& mark : method.marks) {
      if (!mark.point->failure.empty() || (!mark.is_complete && !mark.point->gradient_failure.empty())) {
        text += failure_row(*mark.point);
        continue;
      }
      text += fmt::format("{:>10} {:>11.4g} {:>10.3g} {:>11.3g} {:>9}  {}{}{}{}{}\n", cells_of(*mark.point),
                          mark.point->step, mark.at.error, mark.at.seconds, mark_order(method, mark),
                          mark.at.is_pareto ? "*" : "", solve_text(*mark.point),
                          mark.point->is_above_limit ? " (above the largest stable step)" : "",
                          chart::is_wide(mark.at) ? " (timings vary)" : "",
                          mark.at.error < uncertainty ? " (below the error of the reference)" : "");
    }
  }
  return text + "* nothing else is both faster and more accurate\n";
}

/// Returns text; sets `result` to the JSON.
std::string report_speed_ups(const std::vector<chart::MethodMarks>& methods, Json& result) {
  std::string text;
  result = Json::array();
  for (const chart::SpeedUp& speed_up : chart::speed_ups(methods)) {
    const bool overlaps = speed_up.error > 0, has_interval = speed_up.high > 0;
    result.push_back({{"method", speed_up.method},
                      {"against", methods.front().name},
                      {"error", overlaps ? Json(speed_up.error) : Json(nullptr)},
                      {"ratio", overlaps ? Json(speed_up.ratio) : Json(nullptr)},
                      {"interval", has_interval ? Json({speed_up.low, speed_up.high}) : Json(nullptr)}});
    const std::string interval =
        has_interval ? fmt::format(" (95 of 100: {:.3g} to {:.3g})", speed_up.low, speed_up.high) : "";
    text += overlaps ? fmt::format("  {}: {:.3g} times as fast at an error of {:.2g}{}\n", speed_up.method,
                                   speed_up.ratio, speed_up.error, interval)
                     : fmt::format("  {}: no overlap of errors\n", speed_up.method);
  }
  return text.empty() ? "" : fmt::format("at equal accuracy, against {}:\n", methods.front().name) + text;
}

Json slopes_of(const std::vector<chart::MethodMarks>& methods, double uncertainty) {
  Json result = Json::array();
  for (const chart::MethodMarks& method : methods)
    result.push_back(
        {{"name", method.name}, {"slope", json_number(chart::slope_of(chart::unbeaten_of(method), uncertainty))}});
  return result;
}

/// RFC 4180: quotes fields with commas, quotes or line breaks; quotes inside are doubled.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

/// Text about the fastest point that meets the tolerance.
std::string report_tolerance(const ChartOfScene& chart, Json& result) {
  if (!(chart.tolerance > 0)) return "";
  const Point* fastest = nullptr;
  for (const Point& point : chart.points) {
    const bool meets = is_complete(point) && point.error <= chart.tolerance;
    if (meets && (fastest == nullptr || point.seconds < fastest->seconds)) fastest = &point;
  }
  result["tolerance"] = chart.tolerance;
  result["meets_tolerance"] = fastest == nullptr ? Json(nullptr) : chart::point_json(*fastest);
  if (fastest == nullptr) return fmt::format("no point meets the tolerance of {:g}\n", chart.tolerance);
  return fmt::format("the fastest that meets the tolerance of {:g}: {} on {} cells, steps of {:.4g}{}\n",
                     chart.tolerance, chart::method_text(fastest->variant), cells_of(*fastest), fastest->step,
                     solve_text(*fastest));
}

plot::LinePanel state_panel(const ChartOfScene& chart, const std::vector<chart::MethodMarks>& methods) {
  const std::string threads = fmt::format("({} thread{})", chart.threads, chart.threads == 1 ? "" : "s");
  const std::string unit = chart.problem.unit_of("t");
  return plot::chart_panel(
      {fmt::format("{}: speed against accuracy {}", chart.problem.scene, threads), "relative error at the end",
       unit.empty() ? "seconds per unit of time" : fmt::format("seconds for 1 {} of the run", unit),
       driver::machine_name()},
      methods, chart.references.states.uncertainty(), chart.tolerance);
}

plot::LinePanel gradient_panel(const ChartOfScene& chart, const std::vector<chart::MethodMarks>& methods) {
  return plot::chart_panel({fmt::format("{}: gradient", chart.task), "relative error of the gradient",
                            "seconds for value and gradient", driver::machine_name()},
                           methods, chart.references.gradient.uncertainty(), 0);
}

Json reference_json(const std::string& text, double uncertainty) {
  return {{"text", text}, {"uncertainty", json_number(uncertainty)}};
}

std::string known_to(double uncertainty) {
  return uncertainty > 0 ? fmt::format(", which is known to {:.2g}", uncertainty) : "";
}

constexpr double cancelled = 0.2;  // relative to the largest part: below, the sum is too inaccurate to judge

/// Whether both agree within a factor of 1.5; otherwise the runs are not in the asymptotic range.
bool adds_up(double sum, double measured) { return sum < 1.5 * measured && measured < 1.5 * sum; }

/// One row for each point with a budget.
std::string budget_rows(const std::vector<Point>& points) {
  const auto part_text = [](const chart::Budget::Part& part) {
    return part.order > 0 ? fmt::format("{:.2g} (order {:.2f})", part.error, part.order)
                          : fmt::format("{:.2g} (no order)", part.error);
  };
  std::string text;
  for (const Point& point : points) {
    if (!point.budget) continue;
    const chart::Budget& budget = *point.budget;
    text += fmt::format("{} on {} cells, step {:.4g}{}: ", chart::method_text(point.variant), cells_of(point),
                        point.step, solve_text(point));
    if (!budget.failure.empty()) {
      text += fmt::format("no budget: {}\n", budget.failure);
      continue;
    }
    const double largest = std::max(budget.space.error, budget.time.error);
    text += fmt::format(
        "space {}, time {}{}{}; together{} {:.2g}, measured {:.2g}{}; {} is largest\n", part_text(budget.space),
        part_text(budget.time), budget.rounding ? fmt::format(", rounding {:.2g}", *budget.rounding) : "",
        budget.solves ? fmt::format(", solves {:.2g}", *budget.solves) : "",
        budget.sum < cancelled * largest ? ", as parts cancel," : "", budget.sum, point.error,
        adds_up(budget.sum, point.error) ? "" : " (too few cells or steps for an order: the parts are rough)",
        budget.largest());
  }
  return text.empty() ? "" : "where the error comes from:\n" + text;
}

/// Returns text; sets `result` to the JSON.
std::string report_gradients(const ChartOfScene& chart, const std::vector<chart::MethodMarks>& methods, Json& result) {
  const chart::GradientReference& reference = chart.references.gradient;
  result = {{"task", chart.task},
            {"reference", reference_json(reference.text(), reference.uncertainty())},
            {"methods", slopes_of(methods, reference.uncertainty())}};
  std::string text = fmt::format("task {}: errors of the gradient against {}{}\n", chart.task, reference.text(),
                                 known_to(reference.uncertainty()));
  text += marks_table(methods, reference.uncertainty(), "s");
  return text + report_speed_ups(methods, result["speed_up"]);
}

}  // namespace

Report chart_report(const ChartOfScene& chart) {
  Report report;
  Json& result = report.json;
  const model::Problem& problem = chart.problem;
  const chart::Reference& reference = chart.references.states;
  const std::vector<chart::MethodMarks> methods = chart::marks_of(chart.points, chart::ChartOf::states),
                                        gradients = chart::marks_of(chart.points, chart::ChartOf::gradient);
  result["scene"] = problem.scene;
  result["reference"] = reference_json(reference.text(), reference.uncertainty());
  result["threads"] = chart.threads;
  result["machine"] = {{"name", driver::machine_name()}, {"cores", std::thread::hardware_concurrency()}};
  result["busy"] = chart::is_machine_busy(methods);
  result["points"] = Json::array();
  for (const Point& point : chart.points) result["points"].push_back(chart::point_json(point));
  result["methods"] = slopes_of(methods, reference.uncertainty());
  report.say(fmt::format("{}: errors at t = {:.6g} against {}{}\n", problem.scene,
                         problem.t_begin + problem.steps * problem.step, reference.text(),
                         known_to(reference.uncertainty())));
  report.say(marks_table(methods, reference.uncertainty(), "s per unit"));
  report.say(report_speed_ups(methods, result["speed_up"]));
  report.say(report_tolerance(chart, result));
  const std::string budget = budget_rows(chart.points);
  report.say(budget);
  if (!budget.empty() && !chart.task.empty())
    report.say("  this is of the fields: errors of gradients are not taken apart\n");
  if (!chart.task.empty()) report.say(report_gradients(chart, gradients, result["gradient"]));
  if (chart::is_machine_busy(methods)) report.say("timings vary: the machine is busy, and times are worth little\n");
  return report;
}

std::string chart_table(const std::vector<Point>& points) {
  std::string text =
      "method,cells,step,steps,solve,error,wall_s,low_quartile,high_quartile,compile_s,memory_bytes,pareto,failure,"
      "gradient_error,gradient_wall_s,gradient_pareto,gradient_failure\n";
  for (const Point& point : points) {
    text += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}", csv_field(chart::method_text(point.variant)),
                        cells_of(point), point.step, point.steps, csv_field(solve_of(point)),
                        point.failure.empty() ? fmt::format("{}", point.error) : "", point.seconds, point.low_quartile,
                        point.high_quartile, point.compile_seconds, point.memory_bytes, point.is_pareto ? 1 : 0,
                        csv_field(point.failure));
    text += point.gradient ? fmt::format(",{},{},{},", point.gradient->error, point.gradient->seconds,
                                         point.gradient->is_pareto ? 1 : 0)
                           : ",,,,";
    text += csv_field(point.gradient_failure) + "\n";
  }
  return text;
}

std::vector<plot::Panel> chart_panels(const ChartOfScene& chart) {
  std::vector<plot::Panel> panels;
  for (plot::LinePanel& panel :
       std::vector<plot::LinePanel>{state_panel(chart, chart::marks_of(chart.points, chart::ChartOf::states)),
                                    gradient_panel(chart, chart::marks_of(chart.points, chart::ChartOf::gradient))}) {
    if (!panel.curves.empty()) panels.emplace_back(std::move(panel));
  }
  return panels;
}

}  // namespace dpde::report
