// SPDX-License-Identifier: Apache-2.0
#include "report/training/training_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/certificate/comparison.h"
#include "driver/memory/machine_speed.h"
#include "plot/chart_panel.h"
#include "support/names/number_text.h"

namespace dpde::report {

namespace {

using training::mean_and_spread;
using training::TrajectoryTest;

/// Trials of the network, or one plain scene, with their coordinates in the chart.
struct Row {
  std::string title, curve;  // one method on several grids is one curve
  bool has_network = false;
  chart::Point point = {};
  bool made_data = false;  // its errors are only rounding: neither drawn nor compared
};

chart::Point point_of(const TrajectoryTest& test, const training::TestCost& cost) {
  chart::Point point;
  point.error = mean_and_spread(test.means()).mean;
  if (std::isfinite(cost.median())) point.take(cost.samples);
  if (!std::isfinite(point.error)) point.fail(chart::Outcome::blew_up, "blows up");
  return point;
}

/// Names a curve by the first scene of its scheme, ignoring step, precision and tolerances.
class CurveNames {
 public:
  std::string of(model::Test::Baseline beside, model::Scheme scheme) {
    scheme.name.clear();
    scheme.real = Precision::f64;
    scheme.solve.tolerance = SolveBy{}.tolerance;
    for (const auto& [known, name] : known_) {
      if (known == scheme) return name;
    }
    for (const char* key : {"step", "real", "solve"}) beside.method.erase(key);
    known_.emplace_back(std::move(scheme), training::title_of(beside));
    return known_.back().second;
  }

 private:
  std::vector<std::pair<model::Scheme, std::string>> known_;
};

std::vector<Row> rows_of(const training::TestScenes& scenes, const training::TestResults& results, std::size_t i) {
  std::vector<Row> rows;
  for (std::size_t k = 0; k < results.trials.size(); ++k) {
    const TrajectoryTest& trial = results.trials[k][i];
    const std::string number = results.trials.size() > 1 ? fmt::format(", trial {}", k + 1) : "";
    rows.push_back({trial.scene + number, trial.scene, true, point_of(trial, results.costs[i][0])});
  }
  CurveNames names;
  for (std::size_t s = 0; s < results.beside[i].size(); ++s) {
    const TrajectoryTest& test = results.beside[i][s];
    const model::Test::Baseline& beside = scenes.tests[i].beside[s];
    const model::Scheme& scheme = scenes.beside->scene(beside).compiled->problem->scheme;
    const std::string curve = test.has_network ? test.scene : names.of(beside, scheme);
    rows.push_back({test.scene, curve, test.has_network, point_of(test, results.costs[i][s + 1]), test.made_data});
  }
  std::vector<chart::Point> points;
  for (const Row& row : rows) {
    if (!row.made_data) points.push_back(row.point);
  }
  chart::mark_pareto(points);
  auto marked = points.begin();
  for (Row& row : rows) {
    if (!row.made_data) row.point = *marked++;
  }
  return rows;
}

std::vector<chart::MethodMarks> marks_of(const std::vector<Row>& rows) {
  std::vector<chart::MethodMarks> methods;
  for (const Row& row : rows) {
    if (row.made_data) continue;
    auto known = std::ranges::find(methods, row.curve, &chart::MethodMarks::name);
    if (known == methods.end()) known = methods.insert(methods.end(), {row.curve, {}});
    known->marks.push_back({row.point, chart::is_complete(row.point), &row.point});
  }
  return methods;
}

/// Best plain method: at the network's error, and the most accurate one if none reaches that.
struct BestPlain {
  analysis::Equal at_error;
  std::optional<analysis::CostAndError> most_accurate;
};
BestPlain best_plain(const std::vector<Row>& rows, double error) {
  std::vector<analysis::CostAndError> plain;
  for (const Row& row : rows) {
    if (!row.has_network && !row.made_data) plain.push_back({row.title, row.point.seconds, row.point.error});
  }
  const std::vector<analysis::CostAndError> best = analysis::best_of(plain);
  BestPlain found{analysis::cost_of_equal_error(plain, error), {}};
  if (!best.empty()) found.most_accurate = best.back();
  return found;
}

/// CPU seconds of data and training; unknown parts count 0, which the curve states.
struct Spent {
  double seconds = 0;
  bool is_whole = true;
};
Spent spent_on(const training::Investment& investment) {
  Spent spent;
  for (const double part : {investment.data_s, investment.training_s}) {
    spent.is_whole = spent.is_whole && !std::isnan(part);
    if (!std::isnan(part)) spent.seconds += part;
  }
  return spent;
}

/// Number of runs after which data and training pay off. If no plain method reaches the error, one that does would take
/// longer than the most accurate one, so the number is an upper bound.
struct Earned {
  std::optional<double> runs;
  bool is_bound = false;
};
Earned earned(const BestPlain& plain, double cost, double length, const Spent& spent) {
  if (!plain.most_accurate || !spent.is_whole) return {};
  Earned result;
  result.is_bound = plain.at_error.kind == analysis::Equal::Kind::beyond_all;
  analysis::Equal equal = plain.at_error;
  if (result.is_bound) equal = {analysis::Equal::Kind::found, plain.most_accurate->cost};
  const analysis::BreakEven even = analysis::break_even(equal, cost, length, spent.seconds);
  if (even.kind == analysis::BreakEven::Kind::after) result.runs = even.runs;
  return result;
}

/// Total seconds against the number of runs.
plot::LinePanel total_panel(const std::vector<Row>& rows, const BestPlain& plain, const Spent& spent, double length) {
  const double cost = rows.front().point.seconds;
  const Earned even = earned(plain, cost, length, spent);
  plot::LinePanel panel;
  panel.title = "cost of all runs";
  if (even.runs) {
    const char* bound = even.is_bound ? "at most " : "";
    panel.title = fmt::format("pays for itself after {}{:.4g} runs", bound, std::ceil(*even.runs));
  }
  panel.x_label = fmt::format("runs of {:.4g} units of time", length);
  panel.y_label = "seconds of a processor, in all";
  panel.log_x = panel.log_y = panel.names_below = true;
  const double most = std::pow(10, std::ceil(std::log10(std::max(1000.0, 10 * even.runs.value_or(0)))));
  const auto add = [&](std::string title, double before, double each) {
    plot::Curve curve{std::move(title), {}, {}};
    for (double runs = 1; runs <= most * 1.001; runs *= std::pow(10, 0.1)) {
      curve.x.push_back(runs);
      curve.y.push_back(before + runs * length * each);
    }
    panel.curves.push_back(std::move(curve));
  };
  add(fmt::format("{} {} training", rows.front().curve, spent.is_whole ? "with" : "without all"), spent.seconds, cost);
  if (plain.at_error.kind != analysis::Equal::Kind::beyond_all) {
    add("plain, of the same error", 0, plain.at_error.value);
  } else if (plain.most_accurate) {
    add(fmt::format("plain, least error {:.2g}", plain.most_accurate->error), 0, plain.most_accurate->cost);
  }
  if (even.runs) {
    plot::Curve crossing{"break-even", {*even.runs, *even.runs}, {cost * length, spent.seconds + most * length * cost}};
    crossing.colour = "#999999";
    panel.curves.push_back(std::move(crossing));
  }
  return panel;
}

Json json_of(const Row& row) {
  return {{"scene", row.title},
          {"method", row.curve},
          {"network", row.has_network},
          {"made_data", row.made_data},
          {"error", json_number(row.point.error)},
          {"wall_s", row.point.seconds > 0 ? json_number(row.point.seconds) : Json(nullptr)},
          {"failure", row.point.failure.empty() ? Json(nullptr) : Json(row.point.failure)},
          {"wall_s_samples", row.point.samples},
          {"stable", !row.point.is_unstable()},
          {"pareto", row.point.is_pareto}};
}

Json json_of(const BestPlain& plain, const Earned& even) {
  if (!plain.most_accurate) return nullptr;
  Json json = {
      {"most_accurate",
       {{"scene", plain.most_accurate->scene},
        {"error", plain.most_accurate->error},
        {"wall_s", plain.most_accurate->cost}}},
      {"at_equal_error", nullptr},
      {"break_even", {{"runs", even.runs ? Json(std::ceil(*even.runs)) : Json(nullptr)}, {"at_most", even.is_bound}}}};
  if (plain.at_error.kind != analysis::Equal::Kind::beyond_all)
    json["at_equal_error"] = {{"between", {plain.at_error.from, plain.at_error.to}}, {"wall_s", plain.at_error.value}};
  return json;
}

std::string table_of(const std::vector<Row>& rows) {
  std::string text = "scene,method,network,made_data,error,wall_s,pareto,failure\n";
  for (const Row& row : rows) {
    text += fmt::format("\"{}\",\"{}\",{},{},", row.title, row.curve, row.has_network ? 1 : 0, row.made_data ? 1 : 0);
    text += fmt::format("{},{},{},{}\n", row.point.error, row.point.seconds, row.point.is_pareto ? 1 : 0,
                        row.point.failure);
  }
  return text;
}

}  // namespace

Report training_chart(const training::TestScenes& scenes, const training::TestResults& results) {
  Report report;
  Json& json = report.json;
  json["points"] = Json::array();
  json["best_plain"] = Json::object();
  if (results.costs.size() != results.start.size())
    return report;  // a file disappeared since the training began, which was reported
  const Spent spent = spent_on(results.spent);
  for (std::size_t i = 0; i < results.start.size(); ++i) {
    if (scenes.tests[i].kind != model::Test::Kind::number || !training::is_compared(scenes.tests[i])) continue;
    const std::string& name = results.start[i].name;
    const std::vector<Row> rows = rows_of(scenes, results, i);
    double error = 0;
    for (const std::vector<TrajectoryTest>& trial : results.trials)
      error += mean_and_spread(trial[i].means()).mean / static_cast<double>(results.trials.size());
    const BestPlain plain = best_plain(rows, error);
    for (const Row& row : rows) json["points"].push_back(json_of(row)), json["points"].back()["test"] = name;
    const double length = results.start[i].times.back();
    const Earned even = earned(plain, rows.front().point.seconds, length, spent);
    json["best_plain"][name] = json_of(plain, even);
    if (plain.most_accurate)
      report.say(fmt::format("the most accurate plain method: {}, error {:.4g}, {} a unit of time\n",
                             plain.most_accurate->scene, plain.most_accurate->error,
                             human_seconds(plain.most_accurate->cost)));
    if (even.runs && even.is_bound)
      report.say(
          fmt::format("  beside it data and training pay for themselves after {:.4g} runs; beside one with the "
                      "network's error after fewer\n",
                      std::ceil(*even.runs)));
    const std::vector<chart::MethodMarks> methods = marks_of(rows);
    const std::string title = fmt::format("{}: speed against accuracy (1 thread)", results.start[i].scene);
    const plot::LinePanel speed = plot::chart_panel({title, fmt::format("{} on {}", name, results.start[i].file),
                                                     "seconds per unit of time", driver::machine_name()},
                                                    methods, 0, 0);
    std::vector<plot::Panel> panels;
    if (!speed.curves.empty()) panels.emplace_back(speed);
    if (is_complete(rows.front().point)) panels.emplace_back(total_panel(rows, plain, spent, length));
    if (!panels.empty()) report.parts.emplace_back(Picture{name + "_chart", std::move(panels)});
    report.add(name + "_chart.csv", table_of(rows));
  }
  return report;
}

}  // namespace dpde::report
