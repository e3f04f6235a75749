// SPDX-License-Identifier: Apache-2.0
// What the tests of a training say: in words, as tables, curves and JSON.
#include "test_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/comparison.h"
#include "support/assert.h"
#include "support/evaluate.h"

namespace dpde::tools {

namespace {

using training::mean_and_spread;
using training::MeanAndSpread;
using training::TrajectoryTest;
using Kind = model::Test::Kind;

Json numbers_of(const TrajectoryTest& test) {
  const MeanAndSpread whole = mean_and_spread(test.means());
  return {{"mean", json_number(whole.mean)},
          {"spread", json_number(whole.spread)},
          {"runs", json_numbers(test.means())},
          {"course", json_numbers(test.course())}};
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

/// Columns of numbers with one name each, a row a time.
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
  for (const TrajectoryTest& beside : *test.beside)
    table.add(fmt::format("{}_of_{}", found.name, beside.scene), spreads_of(beside.runs));
  return table.text();
}

void write_test(Job& job, const OneTest& test) {
  if (job.options().out.empty()) return;
  const TrajectoryTest& found = test.found();
  save_text(job, found.name + ".csv", table_of(test));
  LinePanel panel;
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
  for (const TrajectoryTest& beside : *test.beside)
    panel.curves.push_back({beside.scene, beside.times, beside.course()});
  panel.log_y = spans_decades(panel.curves);
  save_if_drawn(job, found.name, panel);
}

/// Over the trials, in words and as JSON.
void report_trials(Job& job, const OneTest& test, Json& json) {
  if (!test.has_trials()) return;
  const MeanAndSpread over = mean_and_spread(test.means());
  std::string each;
  for (const double mean : test.means()) each += fmt::format("{}{:.6g}", each.empty() ? "" : ", ", shown(mean));
  job.say(fmt::format("  trials: {}; mean {}\n", each, text_of(over)));
  json["trials"] = {{"mean", json_number(over.mean)}, {"spread", json_number(over.spread)}, {"each", Json::array()}};
  for (const TrajectoryTest* trial : test.trials) json["trials"]["each"].push_back(numbers_of(*trial));
}

// ---- plain schemes beside
// --------------------------------------------------------------------------------------------

std::string between_text(const analysis::Equal& equal) {
  return equal.from == equal.to ? "as " + equal.from : fmt::format("between {} and {}", equal.from, equal.to);
}

Json json_of(const analysis::Equal& equal, const char* key, double own) {
  if (equal.kind == analysis::Equal::Kind::beyond_all) return nullptr;
  return {{key, json_number(equal.value)},
          {"ratio", json_number(equal.value / own)},
          {"between", {equal.from, equal.to}},
          {"beyond", equal.kind == analysis::Equal::Kind::within_all}};
}

/// Where the first of the runs is no longer finite.
void say_blow_up(Job& job, const TrajectoryTest& test) {
  for (std::size_t run = 0; run < test.runs.size(); ++run) {
    const auto first = std::ranges::find_if_not(test.runs[run], [](double value) { return std::isfinite(value); });
    if (first == test.runs[run].end()) continue;
    const double t = test.times[static_cast<std::size_t>(first - test.runs[run].begin())];
    job.say(fmt::format(
        "  warning: {} of scene {} is no longer finite in run {} of {} after t = {:.6g} from its first frame\n",
        test.name, test.scene, run, test.file, t));
    return;
  }
}

std::string cost_text(const Investment& spent) {
  const auto one = [](const char* what, double seconds) {
    return std::isnan(seconds) ? fmt::format("the cost of the {} is not known and left out", what)
                               : fmt::format("{} of a processor's time for the {}", human_seconds(seconds), what);
  };
  return one("data", spent.data_s) + ", " + one("training", spent.training_s);
}

/// After how many runs as long as the test's data and training are earned.
void say_break_even(Job& job, const OneTest& test, const analysis::Equal& at_error, Json& json) {
  const Investment& spent = *test.spent;
  const bool is_known = !std::isnan(spent.data_s) || !std::isnan(spent.training_s);
  const double length = test.found().times.back(), sum = (std::isnan(spent.data_s) ? 0 : spent.data_s) +
                                                         (std::isnan(spent.training_s) ? 0 : spent.training_s);
  using When = analysis::BreakEven::Kind;
  const analysis::BreakEven even = break_even(at_error, test.costs[0], length, sum);
  const bool is_whole = !std::isnan(spent.data_s) && !std::isnan(spent.training_s),
             has_number = is_whole && even.kind == When::after;
  json["break_even"] = {{"runs", has_number ? json_number(std::ceil(even.runs)) : Json(nullptr)},
                        {"never", even.kind == When::never},
                        {"length", length},
                        {"data_s", std::isnan(spent.data_s) ? Json(nullptr) : Json(spent.data_s)},
                        {"training_s", std::isnan(spent.training_s) ? Json(nullptr) : Json(spent.training_s)}};
  if (even.kind == When::never) {
    job.say("  data and training never pay for themselves: plain schemes have this error in no more time\n");
  } else if (even.kind == When::unknown) {
    job.say(
        "  whether data and training pay for themselves is not known: none of the plain schemes named has this "
        "error\n");
  } else if (!is_known) {
    job.say(
        "  after how many runs data and training pay for themselves is not known: neither file tells what they cost\n");
  } else {
    job.say(fmt::format("  data and training pay for themselves after {:.4g} runs of {:.4g} units of time ({})\n",
                        std::ceil(even.runs), length, cost_text(spent)));
  }
}

/// What plain schemes cost for the same error, and lose for the same cost; and when training is earned.
void compare(Job& job, const OneTest& test, double error, Json& json) {
  std::vector<analysis::CostAndError> plain;
  for (std::size_t s = 0; s < test.beside->size(); ++s) {
    const TrajectoryTest& beside = (*test.beside)[s];
    if (!beside.has_network && !beside.made_data)
      plain.push_back({beside.scene, test.costs[s + 1], mean_and_spread(beside.means()).mean});
  }
  if (plain.empty() || !std::isfinite(error)) return;
  using Found = analysis::Equal::Kind;
  const double cost = test.costs[0];
  const analysis::Equal at_error = cost_of_equal_error(plain, error), at_cost = error_of_equal_cost(plain, cost);
  json["equal_error"] = json_of(at_error, "cost_s", cost);
  json["equal_cost"] = json_of(at_cost, "error", error);
  const std::string own = fmt::format("its {} of {:.4g}", test.found().name, shown(error));
  switch (at_error.kind) {
    case Found::found:
      job.say(fmt::format("  for {} plain schemes take {} a unit of time, {:.3g} times as long ({})\n", own,
                          human_seconds(at_error.value), at_error.value / cost, between_text(at_error)));
      break;
    case Found::beyond_all: job.say(fmt::format("  for {}: none of the plain schemes named reaches it\n", own)); break;
    case Found::within_all:
      job.say(fmt::format(
          "  for {}: the cheapest plain scheme named is better, and takes {} a unit of time, {:.3g} times as long\n",
          own, human_seconds(at_error.value), at_error.value / cost));
      break;
  }
  switch (at_cost.kind) {
    case Found::found:
      job.say(fmt::format("  for its time plain schemes have {} = {:.4g}, {:.3g} times as much ({})\n",
                          test.found().name, at_cost.value, at_cost.value / error, between_text(at_cost)));
      break;
    case Found::beyond_all: job.say("  for its time: none of the plain schemes named is as cheap\n"); break;
    case Found::within_all:
      job.say(fmt::format(
          "  for its time: the dearest plain scheme named takes less, with {} = {:.4g}, {:.3g} times as much\n",
          test.found().name, at_cost.value, at_cost.value / error));
      break;
  }
  say_break_even(job, test, at_error, json);
}

/// On a chart most methods blow up somewhere, and a word is enough.
void report_beside(Job& job, const OneTest& test, bool is_chart, Json& json) {
  if (test.beside->empty()) return;
  const double error = mean_and_spread(test.means()).mean;
  const TrajectoryTest& found = test.found();
  std::string table = "scene,file,network,mean,spread,cost_s\n";
  const auto row = [&](const TrajectoryTest& each, double cost) {
    const MeanAndSpread whole = mean_and_spread(each.means());
    table += fmt::format("{},{},{},{},{},{}\n", each.scene, each.file, each.has_network ? 1 : 0, whole.mean,
                         whole.spread, cost);
    const std::string time = std::isfinite(cost) ? human_seconds(cost) + " a unit of time" : "blows up";
    const char* maker = each.made_data ? "; it made the data, and is left out of what follows" : "";
    job.say(fmt::format("  {}: {} on {}, {}{}\n", each.scene, text_of(whole), each.file, time, maker));
    if (&each != &found && !is_chart) say_blow_up(job, each);
  };
  json["cost_s"] = json_number(test.costs[0]);
  json["beside"] = Json::object();
  row(found, test.costs[0]);
  for (std::size_t s = 0; s < test.beside->size(); ++s) {
    const TrajectoryTest& each = (*test.beside)[s];
    row(each, test.costs[s + 1]);
    Json beside = numbers_of(each);
    beside.update({{"file", each.file},
                   {"network", each.has_network},
                   {"made_data", each.made_data},
                   {"cost_s", json_number(test.costs[s + 1])}});
    json["beside"][each.scene] = std::move(beside);
  }
  if (!job.options().out.empty()) save_text(job, found.name + "_beside.csv", table);
  compare(job, test, error, json);
}

Json report_test(Job& job, const OneTest& test, bool is_chart) {
  const MeanAndSpread learnt = mean_and_spread(test.found().means()), before = mean_and_spread(test.start->means());
  job.say(fmt::format("test {} = {} over {} runs of {} ({} at the start)\n", test.found().name, text_of(learnt),
                      test.found().runs.size(), test.found().file, text_of(before)));
  say_blow_up(job, test.found());
  Json json = numbers_of(test.found());
  json["t"] = json_numbers(test.found().times);
  json["start"] = numbers_of(*test.start);
  report_trials(job, test, json);
  report_beside(job, test, is_chart, json);
  return json;
}

// ---- statistics
// ------------------------------------------------------------------------------------------------------

/// Mean and standard deviation over the times, in the mean over the runs.
struct OverTime {
  MeanAndSpread mean, deviation;
};
OverTime over_time(const std::vector<std::vector<double>>& runs) {
  return {mean_and_spread(TrajectoryTest::means_of(runs)), mean_and_spread(TrajectoryTest::deviations_of(runs))};
}

Json json_of(const std::vector<std::vector<double>>& runs) {
  const OverTime all = over_time(runs);
  return {{"mean", json_number(all.mean.mean)},
          {"mean_spread", json_number(all.mean.spread)},
          {"deviation", json_number(all.deviation.mean)},
          {"deviation_spread", json_number(all.deviation.spread)},
          {"course", json_numbers(TrajectoryTest::course_of(runs))}};
}

/// In parts of the data's; where that is 0 there are none.
double difference(double value, double of_data) {
  return of_data == 0 ? std::nan("") : (value - of_data) / std::abs(of_data);
}

std::string difference_text(double value, double of_data) {
  return of_data == 0 ? fmt::format("{:+.2g} more", shown(value))
                      : fmt::format("{:+.2g} %", shown(100 * difference(value, of_data)));
}

Json difference_json(double value, double of_data) {
  return of_data == 0 ? Json(nullptr) : json_number(difference(value, of_data));
}

/// Of a scene, beside what the data of its own file say.
Json report_statistic_of(Job& job, const std::string& title, const TrajectoryTest& test) {
  const OverTime own = over_time(test.runs), data = over_time(test.data);
  job.say(fmt::format("  {}: mean {:.5g} ({}), deviation {:.4g} ({}); the data of {}: {:.5g}, {:.4g}\n", title,
                      shown(own.mean.mean), difference_text(own.mean.mean, data.mean.mean), shown(own.deviation.mean),
                      difference_text(own.deviation.mean, data.deviation.mean), test.file, shown(data.mean.mean),
                      shown(data.deviation.mean)));
  Json json = json_of(test.runs);
  json.update({{"file", test.file},
               {"data", json_of(test.data)},
               {"mean_difference", difference_json(own.mean.mean, data.mean.mean)},
               {"deviation_difference", difference_json(own.deviation.mean, data.deviation.mean)}});
  return json;
}

Json report_statistic(Job& job, const OneTest& test) {
  const TrajectoryTest& found = test.found();
  job.say(fmt::format("statistic {} over {} runs to t = {:.4g}\n", found.name, found.runs.size(), found.times.back()));
  Json json = report_statistic_of(job, found.scene, found);
  json["t"] = json_numbers(found.times);
  json["start"] = report_statistic_of(job, "at the start", *test.start);
  for (std::size_t k = 0; test.has_trials() && k < test.trials.size(); ++k)
    json["trials"].push_back(json_of(test.trials[k]->runs));
  if (test.has_trials()) {
    const MeanAndSpread over = mean_and_spread(test.means());
    job.say(fmt::format("  over the trials: mean {}\n", text_of(over)));
  }
  json["beside"] = Json::object();
  for (const TrajectoryTest& beside : *test.beside)
    json["beside"][beside.scene] = report_statistic_of(job, beside.scene, beside);
  return json;
}

// ---- rates of growth
// -------------------------------------------------------------------------------------------------

Json json_of(const training::GrowthTest& growth) {
  const MeanAndSpread all = mean_and_spread(growth.rates);
  return {{"mean", json_number(all.mean)}, {"spread", json_number(all.spread)}, {"runs", json_numbers(growth.rates)}};
}

Json report(Job& job, const OneTest& test, bool is_chart) {
  switch (test.start->kind) {
    case Kind::number: return report_test(job, test, is_chart);
    case Kind::statistic: return report_statistic(job, test);
    case Kind::spectrum: return report_spectrum(job, test);
    case Kind::correlation: return report_correlation(job, test);
  }
  unreachable("kind of test");
}

/// Of --json.
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

void report_tests(Job& job, const TestResults& results, Json& json) {
  json["test"] = Json::object();
  if (results.costs.size() != results.start.size()) return;  // a file has gone since the training began: reported
  for (std::size_t i = 0; i < results.start.size(); ++i) {
    OneTest test{{}, results.best, &results.start[i], &results.beside[i], {}, &results.spent};
    for (const training::TestCost& cost : results.costs[i])  // as points of a chart are; else what disturbs least
      test.costs.push_back(results.is_chart ? cost.median() : cost.least());
    for (const std::vector<TrajectoryTest>& trial : results.trials) {
      if (i < trial.size()) test.trials.push_back(&trial[i]);
    }
    if (test.trials.size() != results.trials.size()) continue;
    json[key_of(test.start->kind)][test.start->name] = report(job, test, results.is_chart);
    if (test.start->kind != Kind::spectrum && !results.is_chart) write_test(job, test);
  }
}

void report_growths(Job& job, const GrowthResults& results, Json& json) {
  for (std::size_t i = 0; i < results.start.size(); ++i) {
    const training::GrowthTest& found = results.trials[results.best][i];
    Json growth = json_of(found);
    job.say(fmt::format("growth {} of {} = {} a unit of time over {} runs of {} ({} at the start)\n", found.name,
                        found.scene, text_of(mean_and_spread(found.rates)), found.rates.size(), found.file,
                        text_of(mean_and_spread(results.start[i].rates))));
    growth["start"] = json_of(results.start[i]);
    std::vector<double> means;
    for (const std::vector<training::GrowthTest>& trial : results.trials)
      means.push_back(mean_and_spread(trial[i].rates).mean);
    if (means.size() > 1) {
      const MeanAndSpread over = mean_and_spread(means);
      job.say(fmt::format("  over the trials: {}\n", text_of(over)));
      growth["trials"] = {
          {"mean", json_number(over.mean)}, {"spread", json_number(over.spread)}, {"each", json_numbers(means)}};
    }
    growth["beside"] = Json::object();
    for (const training::GrowthTest& beside : results.beside[i]) {
      job.say(fmt::format("  {}: {}\n", beside.scene, text_of(mean_and_spread(beside.rates))));
      growth["beside"][beside.scene] = json_of(beside);
    }
    json["growth"][found.name] = std::move(growth);
  }
}

}  // namespace dpde::tools
