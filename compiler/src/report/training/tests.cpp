// SPDX-License-Identifier: Apache-2.0
#include "report/training/tests.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "report/scene/solves.h"
#include "report/training/beside.h"
#include "report/training/one_test.h"
#include "support/assert.h"
#include "support/maths/evaluate.h"

namespace dpde::report {

namespace {

using training::mean_and_spread;
using training::MeanAndSpread;
using training::TrajectoryTest;
using Kind = model::Test::Kind;

Json numbers_of(const TrajectoryTest& test) {
  const MeanAndSpread whole = mean_and_spread(test.means());
  Json json = {{"mean", json_number(whole.mean)},
               {"spread", spread_json(whole.spread)},
               {"runs", json_numbers(test.means())},
               {"course", json_numbers(test.course())}};
  if (!test.solves.empty()) json["solves"] = json_of(test.solves);
  return json;
}

/// Mean and spread over the runs at each time.
std::vector<MeanAndSpread> spreads_of(const std::vector<std::vector<double>>& runs) {
  std::vector<MeanAndSpread> all;
  for (std::size_t k = 0; k < runs[0].size(); ++k) {
    std::vector<double> values;
    for (const std::vector<double>& run : runs) values.push_back(run[k]);
    all.push_back(mean_and_spread(values));
  }
  return all;
}

/// Named columns of numbers, one row for each time.
class Table {
 public:
  explicit Table(const std::vector<double>& times) : times_(times) {}
  void add(const std::string& name, const std::vector<double>& column) {
    names_ += "," + name;
    columns_.push_back(column);
  }
  void add(const std::string& name, const std::vector<MeanAndSpread>& columns) {
    std::vector<double> means, spreads;
    for (const MeanAndSpread& each : columns) {
      means.push_back(each.mean);
      spreads.push_back(each.spread);
    }
    add(name, means);
    add(name + "_spread", spreads);
  }
  std::string text() const {
    std::string text = "t" + names_ + "\n";
    for (std::size_t k = 0; k < times_.size(); ++k) {
      text += fmt::format("{}", times_[k]);
      for (const std::vector<double>& column : columns_) text += fmt::format(",{}", column[k]);
      text += "\n";
    }
    return text;
  }

 private:
  const std::vector<double>& times_;
  std::string names_;
  std::vector<std::vector<double>> columns_;
};

std::string table_of(const OneTest& test) {
  const TrajectoryTest& found = test.found();
  Table table(found.times);
  table.add(found.name, spreads_of(found.runs));
  table.add(found.name + "_at_start", spreads_of(test.start->runs));
  for (std::size_t k = 0; test.has_trials() && k < test.trials.size(); ++k)
    table.add(fmt::format("{}_of_trial_{}", found.name, k + 1), test.trials[k]->course());
  std::vector<MeanAndSpread> over;
  for (std::size_t k = 0; k < found.times.size(); ++k) over.push_back(test.at(k));
  if (test.has_trials()) table.add(found.name + "_of_trials", over);
  if (found.kind == Kind::statistic) table.add(found.name + "_of_data", spreads_of(found.data));
  for (const TrajectoryTest& beside : *test.beside) {
    if (!beside.is_named) continue;
    table.add(fmt::format("{}_of_{}", found.name, beside.scene), spreads_of(beside.runs));
  }
  return table.text();
}

void write_test(Report& report, const OneTest& test) {
  const TrajectoryTest& found = test.found();
  report.add(found.name + ".csv", table_of(test));
  plot::LinePanel panel;
  panel.title = fmt::format("{} on {}", found.name, found.file);
  panel.x_label = "t";
  panel.y_label = found.name;
  if (found.kind == Kind::statistic)
    panel.curves.push_back({"data", found.times, TrajectoryTest::course_of(found.data)});
  for (std::size_t k = 0; k < test.trials.size(); ++k) {
    panel.curves.push_back({test.has_trials()      ? fmt::format("{}, trial {}", found.scene, k + 1)
                            : test.beside->empty() ? "learnt"
                                                   : found.scene,
                            found.times, test.trials[k]->course()});
  }
  panel.curves.push_back({"at the start", test.start->times, test.start->course()});
  for (const TrajectoryTest& beside : *test.beside) {
    if (beside.is_named) panel.curves.push_back({beside.scene, beside.times, beside.course()});
  }
  panel.log_y = plot::spans_decades(panel.curves);
  report.add_if_drawn(found.name, panel);
}

/// Reports mean and spread over the trials, as text and JSON.
void report_trials(Report& report, const OneTest& test, Json& json) {
  if (!test.has_trials()) return;
  const MeanAndSpread over = mean_and_spread(test.means());
  std::string each;
  for (const double mean : test.means()) each += fmt::format("{}{:.6g}", each.empty() ? "" : ", ", shown(mean));
  report.say(fmt::format("  trials: {}; mean {}\n", each, text_of(over)));
  json["trials"] = {{"mean", json_number(over.mean)}, {"spread", spread_json(over.spread)}, {"each", Json::array()}};
  for (const TrajectoryTest* trial : test.trials) json["trials"]["each"].push_back(numbers_of(*trial));
}

Json report_test(Report& report, const OneTest& test) {
  const MeanAndSpread learnt = mean_and_spread(test.found().means()), before = mean_and_spread(test.start->means());
  report.say(fmt::format("test {} = {} over {} of {} ({} at the start)\n", test.found().name, text_of(learnt),
                         counted_runs(test.found().runs.size()), test.found().file, text_of(before)));
  if (learnt.mean > before.mean && !(before.mean < 0))
    report.say("  warning: that is more than at the start: what was learnt makes these runs no better\n");
  say_blow_up(report, test.found());
  Json json = numbers_of(test.found());
  json["t"] = json_numbers(test.found().times);
  json["start"] = numbers_of(*test.start);
  report_trials(report, test, json);
  if (test.beside->empty()) say_solves(report, test.found());
  report_beside(report, test, json);
  return json;
}

// ---- statistics ---------------------------------------------------------------------------------------------------

/// Mean and standard deviation over time, averaged over the runs.
struct OverTime {
  MeanAndSpread mean, deviation;
};
OverTime over_time(const std::vector<std::vector<double>>& runs) {
  return {mean_and_spread(TrajectoryTest::means_of(runs)), mean_and_spread(TrajectoryTest::deviations_of(runs))};
}

Json json_of(const std::vector<std::vector<double>>& runs) {
  const OverTime all = over_time(runs);
  return {{"mean", json_number(all.mean.mean)},
          {"mean_spread", spread_json(all.mean.spread)},
          {"deviation", spread_json(all.deviation.mean)},
          {"deviation_spread", spread_json(all.deviation.spread)},
          {"course", json_numbers(TrajectoryTest::course_of(runs))}};
}

/// Relative difference from the data; NaN if these are 0.
double difference(double value, double of_data) {
  return of_data == 0 ? std::nan("") : (value - of_data) / std::abs(of_data);
}

std::string difference_text(double value, double of_data) {
  return of_data == 0 ? fmt::format("{:+.2g} more", shown(value))
                      : fmt::format("{:+.2g} %", shown(100 * difference(value, of_data)));
}

Json difference_json(double value, double of_data) {
  return of_data == 0 ? Json(nullptr) : spread_json(difference(value, of_data));
}

/// Reports a scene's statistic and that of its own data.
Json report_statistic_of(Report& report, const std::string& title, const TrajectoryTest& test) {
  const OverTime own = over_time(test.runs), data = over_time(test.data);
  std::string deviation, of_data;
  if (test.times.size() > 1) {  // a single time has no deviation
    deviation = fmt::format(", deviation {:.4g} ({})", shown(own.deviation.mean),
                            difference_text(own.deviation.mean, data.deviation.mean));
    of_data = fmt::format(", {:.4g}", shown(data.deviation.mean));
  }
  report.say(fmt::format("  {}: mean {:.5g} ({}){}; the data of {}: {:.5g}{}\n", title, shown(own.mean.mean),
                         difference_text(own.mean.mean, data.mean.mean), deviation, test.file, shown(data.mean.mean),
                         of_data));
  Json json = json_of(test.runs);
  json.update({{"file", test.file},
               {"data", json_of(test.data)},
               {"mean_difference", difference_json(own.mean.mean, data.mean.mean)},
               {"deviation_difference", difference_json(own.deviation.mean, data.deviation.mean)}});
  return json;
}

Json report_statistic(Report& report, const OneTest& test) {
  const TrajectoryTest& found = test.found();
  report.say(fmt::format("statistic {} over {} to t = {:.4g}\n", found.name, counted_runs(found.runs.size()),
                         found.times.back()));
  Json json = report_statistic_of(report, found.scene, found);
  json["t"] = json_numbers(found.times);
  json["start"] = report_statistic_of(report, "at the start", *test.start);
  for (std::size_t k = 0; test.has_trials() && k < test.trials.size(); ++k)
    json["trials"].push_back(json_of(test.trials[k]->runs));
  if (test.has_trials()) {
    const MeanAndSpread over = mean_and_spread(test.means());
    report.say(fmt::format("  over the trials: mean {}\n", text_of(over)));
  }
  json["beside"] = Json::object();
  for (const TrajectoryTest& beside : *test.beside)
    json["beside"][beside.scene] = report_statistic_of(report, beside.scene, beside);
  return json;
}

// ---- growth rates -----------------------------------------------------------------------------------------------

Json json_of(const training::GrowthTest& growth) {
  const MeanAndSpread all = mean_and_spread(growth.rates);
  return {{"mean", json_number(all.mean)}, {"spread", spread_json(all.spread)}, {"runs", json_numbers(growth.rates)}};
}

Json json_of(Report& report, const OneTest& test) {
  switch (test.start->kind) {
    case Kind::number: return report_test(report, test);
    case Kind::statistic: return report_statistic(report, test);
    case Kind::spectrum: return spectrum_report(report, test);
    case Kind::correlation: return correlation_report(report, test);
  }
  unreachable("kind of test");
}

// ---- conditions of a test -----------------------------------------------------------------------------------------

std::string runs_text(const std::vector<int>& runs) {
  return fmt::format("run{} {}", runs.size() == 1 ? "" : "s", fmt::join(runs, ", "));
}

std::string outside_text(const training::TestConditions::Outside& outside) {
  std::vector<int> runs;
  double low = outside.runs.begin()->second, high = low;
  for (const auto& [run, value] : outside.runs) {
    runs.push_back(run);
    low = std::min(low, value);
    high = std::max(high, value);
  }
  const std::string values = low == high ? fmt::format("{:.4g}", low) : fmt::format("{:.4g} to {:.4g}", low, high);
  return fmt::format("{} {} ({}; {:.4g} to {:.4g} learnt)", outside.what, values, runs_text(runs), outside.low,
                     outside.high);
}

std::string error_text(const std::string& variable, const files::Trajectories::OwnError& error) {
  return error.value > 0 ? fmt::format("{} about {:.2g}", variable, error.value)
                         : fmt::format("{} not known: {}", variable, error.why_not);
}

/// Compares the runs of a file with the training runs.
void say_conditions(Report& report, const std::string& file, const training::TestConditions& conditions) {
  if (conditions.is_training_file) report.say(fmt::format("warning: {} is the file that was learnt from\n", file));
  if (!conditions.known_runs.empty())
    report.say(fmt::format("warning: {} of {} {}\n", runs_text(conditions.known_runs), file,
                           conditions.known_runs.size() == 1 ? "begins with a frame that was learnt from"
                                                             : "begin with frames that were learnt from"));
  std::vector<std::string> outside, errors;
  for (const auto& each : conditions.outside) outside.push_back(outside_text(each));
  for (const auto& [variable, error] : conditions.own_errors) errors.push_back(error_text(variable, error));
  const std::string range = !conditions.knows_training ? "the data that were learnt from are not there to compare with"
                            : outside.empty()
                                ? "parameters and first states lie in the range of the training"
                                : "outside of the training: " + fmt::format("{}", fmt::join(outside, "; "));
  report.say(fmt::format("{}: {} steps, {:.3g} times a window of the training; {}\n", file, conditions.steps,
                         static_cast<double>(conditions.steps) / conditions.steps_of_windows, range));
  report.say(errors.empty()
                 ? "  how good these data are its file does not say\n"
                 : fmt::format("  error of these data, root of the mean square: {}\n", fmt::join(errors, "; ")));
}

Json conditions_json(const training::TestConditions& conditions) {
  Json json = {{"knows_training", conditions.knows_training},
               {"training_file", conditions.is_training_file},
               {"known_runs", conditions.known_runs},
               {"outside", Json::object()},
               {"own_error", Json::object()},
               {"steps", conditions.steps},
               {"steps_of_windows", conditions.steps_of_windows}};
  for (const auto& each : conditions.outside) {
    Json& one = json["outside"][each.what];
    one = {{"low", json_number(each.low)}, {"high", json_number(each.high)}, {"runs", Json::object()}};
    for (const auto& [run, value] : each.runs) one["runs"][std::to_string(run)] = json_number(value);
  }
  for (const auto& [variable, error] : conditions.own_errors)
    json["own_error"][variable] = error.value > 0 ? json_number(error.value) : Json(nullptr);
  return json;
}

/// Key in --json.
const char* key_of(Kind kind) {
  switch (kind) {
    case Kind::number: return "test";
    case Kind::statistic: return "statistic";
    case Kind::spectrum: return "spectrum";
    case Kind::correlation: return "correlation";
  }
  unreachable("kind of test");
}

}  // namespace

Report tests_report(const training::TestResults& results) {
  Report report;
  report.json["test"] = Json::object();
  if (results.costs.size() != results.start.size())
    return report;  // a file disappeared since the training began, which was reported
  std::set<std::string> files;
  for (std::size_t i = 0; i < results.start.size(); ++i) {
    OneTest test{{}, results.best, &results.start[i], &results.beside[i], {}, &results.spent, results.is_chart};
    for (const training::TestCost& cost : results.costs[i])  // median in charts, else minimum
      test.costs.push_back(results.is_chart ? cost.median() : cost.least());
    for (const std::vector<TrajectoryTest>& trial : results.trials) {
      if (i < trial.size()) test.trials.push_back(&trial[i]);
    }
    if (test.trials.size() != results.trials.size()) continue;
    if (files.insert(test.start->file).second) say_conditions(report, test.start->file, results.conditions[i]);
    Json& told = report.json[key_of(test.start->kind)][test.start->name];
    told = json_of(report, test);
    told["conditions"] = conditions_json(results.conditions[i]);
    if (test.start->kind != Kind::spectrum && !results.is_chart) write_test(report, test);
  }
  return report;
}

Report growths_report(const training::GrowthResults& results) {
  Report report;
  for (std::size_t i = 0; i < results.start.size(); ++i) {
    const training::GrowthTest& found = results.trials[results.best][i];
    Json growth = json_of(found);
    report.say(fmt::format("growth {} of {} = {} a unit of time over {} of {} ({} at the start)\n", found.name,
                           found.scene, text_of(mean_and_spread(found.rates)), counted_runs(found.rates.size()),
                           found.file, text_of(mean_and_spread(results.start[i].rates))));
    growth["start"] = json_of(results.start[i]);
    std::vector<double> means;
    for (const std::vector<training::GrowthTest>& trial : results.trials)
      means.push_back(mean_and_spread(trial[i].rates).mean);
    if (means.size() > 1) {
      const MeanAndSpread over = mean_and_spread(means);
      report.say(fmt::format("  over the trials: {}\n", text_of(over)));
      growth["trials"] = {
          {"mean", json_number(over.mean)}, {"spread", spread_json(over.spread)}, {"each", json_numbers(means)}};
    }
    growth["beside"] = Json::object();
    for (const training::GrowthTest& beside : results.beside[i]) {
      report.say(fmt::format("  {}: {}\n", beside.scene, text_of(mean_and_spread(beside.rates))));
      growth["beside"][beside.scene] = json_of(beside);
    }
    report.json["growth"][found.name] = std::move(growth);
  }
  return report;
}

std::string weights_not_used_text(const training::TestScenes& scenes) {
  std::string text;
  const model::Problem& own = *scenes.own.compiled->problem;
  std::set<std::string> told;
  for (const model::Test& test : scenes.tests) {
    for (const model::Test::Baseline& beside : test.beside) {
      const model::Problem& problem = *scenes.beside->scene(beside).compiled->problem;
      for (const model::GivenWeights& given : problem.weights) {
        const auto is_it = [&](const model::Unknown& unknown) { return unknown.name == given.network; };
        const auto same = std::ranges::find(own.weights, given.network, &model::GivenWeights::network);
        const bool is_same = same != own.weights.end() && same->from.file == given.from.file;
        if (is_same || std::ranges::none_of(own.task->unknowns, is_it) ||
            !told.insert(problem.scene + " " + given.network).second)
          continue;
        text += fmt::format(
            "warning: scene {} beside is tested with the weights of {} that task {} learns, not with "
            "those of {}, which another network can have\n",
            problem.scene, given.network, own.task->name, given.from.file);
      }
    }
  }
  return text;
}

}  // namespace dpde::report
