// SPDX-License-Identifier: Apache-2.0
// Reports of spectra and correlations of a training, compared with plain schemes.
#include "training/tests/spectrum.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "report/training/beside.h"
#include "report/training/one_test.h"
#include "support/maths/evaluate.h"

namespace dpde::report {

using training::mean_and_spread;
using training::MeanAndSpread;
using training::TrajectoryTest;

namespace {

/// Returns one number for each run of a test; writes the report of a test.
using Figures = std::function<std::vector<double>(const TrajectoryTest&)>;
using OneReport = std::function<Json(const std::string& title, const TrajectoryTest&)>;

/// Reports the result, the start, the trials and the compared scenes, one line each; also writes a table.
Json report_all(Report& report, const OneTest& test, const Figures& figures, const OneReport& report_one) {
  const TrajectoryTest& found = test.found();
  std::string table = "scene,file,network,mean,spread\n";
  const auto add_row = [&](const TrajectoryTest& each) {
    const MeanAndSpread all = mean_and_spread(figures(each));
    table += fmt::format("{},{},{},{},{}\n", each.scene, each.file, each.has_network ? 1 : 0, all.mean, all.spread);
  };
  Json json = report_one(found.scene, found);
  add_row(found);
  json["start"] = report_one("at the start", *test.start);
  std::vector<double> means;
  for (std::size_t k = 0; test.has_trials() && k < test.trials.size(); ++k) {
    means.push_back(mean_and_spread(figures(*test.trials[k])).mean);
    json["trials"]["each"].push_back(json_of(figures(*test.trials[k])));
  }
  if (test.has_trials()) {
    const MeanAndSpread over = mean_and_spread(means);
    report.say(fmt::format("  over the trials: {}\n", text_of(over)));
    json["trials"].update({{"mean", json_number(over.mean)}, {"spread", spread_json(over.spread)}});
  }
  json["beside"] = Json::object();
  for (const TrajectoryTest& beside : *test.beside) {
    json["beside"][beside.scene] = report_one(beside.scene, beside);
    add_row(beside);
  }
  const bool is_compared = !test.costs.empty();  // the comparison has more details
  if (!test.beside->empty() && !is_compared) report.add(found.name + "_beside.csv", table);
  return json;
}

// ---- spectra ------------------------------------------------------------------------------------------------------

std::vector<double> distances(const TrajectoryTest& test, std::size_t last) {
  std::vector<double> all;
  for (std::size_t run = 0; run < test.runs.size(); ++run)
    all.push_back(training::distance(test.runs[run], test.data[run], 1, last, test.noise));
  return all;
}

/// Last shell that all scenes of the test resolve.
std::size_t last_shell(const OneTest& test) {
  std::size_t last = test.start->last_resolved;
  for (const TrajectoryTest& beside : *test.beside) last = std::min(last, beside.last_resolved);
  return last;
}

/// A column of the table and a curve of the picture: energy by shell.
struct Energies {
  std::string column, title;
  std::vector<double> values;
  std::size_t last_resolved = 0;
};

/// Data of other files are on other grids and thus separate.
std::vector<Energies> energies_of(const OneTest& test) {
  const TrajectoryTest& found = test.found();
  const std::size_t last = found.last_resolved;
  std::vector<Energies> all{{found.name + "_of_data", "data", TrajectoryTest::course_of(found.data), last}};
  if (!test.has_trials()) all.push_back({found.name, found.scene, found.course(), last});
  for (std::size_t k = 0; test.has_trials() && k < test.trials.size(); ++k) {
    all.push_back({fmt::format("{}_of_trial_{}", found.name, k + 1), fmt::format("{}, trial {}", found.scene, k + 1),
                   test.trials[k]->course(), last});
  }
  all.push_back({found.name + "_at_start", "at the start", test.start->course(), last});
  for (const TrajectoryTest& beside : *test.beside) {
    all.push_back(
        {fmt::format("{}_of_{}", found.name, beside.scene), beside.scene, beside.course(), beside.last_resolved});
    if (beside.file == found.file) continue;
    all.push_back({fmt::format("{}_of_data_of_{}", found.name, beside.scene), "data of " + beside.file,
                   TrajectoryTest::course_of(beside.data), beside.last_resolved});
  }
  return all;
}

/// Only resolved shells above rounding.
plot::Curve curve_of(const Energies& energies, double noise) {
  double whole = 0;
  for (const double energy : energies.values) whole += energy;
  plot::Curve curve{energies.title, {}, {}};
  for (std::size_t s = 1; s <= energies.last_resolved; ++s) {
    curve.x.push_back(static_cast<double>(s));
    curve.y.push_back(energies.values[s] > noise * whole ? energies.values[s] : std::nan(""));
  }
  return curve;
}

std::string table_of(const std::vector<Energies>& all, double unit) {
  std::string text = "shell,wave_number";
  std::size_t shells = 0;
  for (const Energies& each : all) {
    text += "," + each.column;
    shells = std::max(shells, each.values.size());
  }
  text += "\n";
  for (std::size_t s = 0; s < shells; ++s) {
    text += fmt::format("{},{}", s, static_cast<double>(s) * unit);
    for (const Energies& each : all) text += s < each.values.size() ? fmt::format(",{}", each.values[s]) : ",";
    text += "\n";
  }
  return text;
}

void write_spectrum(Report& report, const OneTest& test) {
  const TrajectoryTest& found = test.found();
  const std::vector<Energies> all = energies_of(test);
  report.add(found.name + ".csv", table_of(all, found.unit));
  plot::LinePanel panel;
  panel.title = fmt::format("{} on {}, mean over time and runs", found.name, found.file);
  panel.x_label = "waves along the longest axis";
  panel.y_label = found.name + " of the shell";
  panel.log_x = panel.log_y = true;
  for (const Energies& each : all) panel.curves.push_back(curve_of(each, found.noise));
  report.add_if_drawn(found.name, panel);
}

}  // namespace

Json spectrum_report(Report& report, const OneTest& test) {
  const TrajectoryTest& found = test.found();
  const std::size_t last = last_shell(test);
  report.say(fmt::format(
      "spectrum {} over {} to t = {:.4g}: mean of |log10| of the ratio to the data's, over shells 1 to {}\n",
      found.name, counted_runs(found.runs.size()), found.times.back(), last));
  const Figures figures = [last](const TrajectoryTest& each) { return distances(each, last); };
  Json json = report_all(report, test, figures, [&](const std::string& title, const TrajectoryTest& each) {
    report.say(fmt::format("  {}: {} on {}\n", title, text_of(mean_and_spread(figures(each))), each.file));
    if (std::ranges::any_of(figures(each), [](double figure) { return std::isnan(figure); }))
      report.say("    the data have nothing in these shells: there is nothing to compare\n");
    return Json{{"file", each.file},
                {"distance", json_of(figures(each))},
                {"energy", json_numbers(each.course())},
                {"data", json_numbers(TrajectoryTest::course_of(each.data))}};
  });
  json["last_shell"] = last;
  json["unit"] = json_number(found.unit);
  write_spectrum(report, test);
  return json;
}

// ---- correlation --------------------------------------------------------------------------------------------------

namespace {

std::vector<training::Crossing> crossings(const TrajectoryTest& test) {
  std::vector<training::Crossing> all;
  for (const std::vector<double>& run : test.runs)
    all.push_back(training::first_below(test.times, run, test.threshold));
  return all;
}

std::vector<double> times_of(const TrajectoryTest& test) {
  std::vector<double> all;
  for (const training::Crossing& crossing : crossings(test)) all.push_back(crossing.time);
  return all;
}

}  // namespace

std::string staying_text(const TrajectoryTest& test) {
  const auto all = crossings(test);
  const auto staying = std::ranges::count(all, false, &training::Crossing::reached);
  if (staying == 0) return "";
  return fmt::format("; {} of {} stay above it to the end, t = {:.4g}, which is taken for their time", staying,
                     counted_runs(all.size()), test.times.back());
}

Json correlation_report(Report& report, const OneTest& test) {
  const TrajectoryTest& found = test.found();
  report.say(fmt::format("correlation {} over {}: time until it falls below {:.6g}\n", found.name,
                         counted_runs(found.runs.size()), found.threshold));
  Json json = report_all(report, test, times_of, [&](const std::string& title, const TrajectoryTest& each) {
    const auto all = crossings(each);
    const auto staying = std::ranges::count(all, false, &training::Crossing::reached);
    const auto is_this = [&](const TrajectoryTest& beside) { return &beside == &each; };
    if (std::ranges::none_of(*test.beside, is_this))  // reported with their costs
      report.say(fmt::format("  {}: {} on {}{}\n", title, text_of(mean_and_spread(times_of(each))), each.file,
                             staying_text(each)));
    if (std::ranges::any_of(all, [](const training::Crossing& one) { return std::isnan(one.time); }))
      report.say("    the data do not vary at some frames: nothing correlates with them\n");
    return Json{{"file", each.file},
                {"time", json_of(times_of(each))},
                {"staying", staying},
                {"course", json_numbers(each.course())}};
  });
  json["threshold"] = found.threshold;
  json["t"] = json_numbers(found.times);
  report_beside(report, test, json);
  return json;
}

}  // namespace dpde::report
