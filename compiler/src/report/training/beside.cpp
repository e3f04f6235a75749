// SPDX-License-Identifier: Apache-2.0
#include "report/training/beside.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "report/scene/solves.h"
#include "report/training/beside_figures.h"
#include "support/maths/evaluate.h"
#include "support/names/number_text.h"

namespace dpde::report {

namespace {

using analysis::Equal;
using analysis::PairedRatio;
using training::mean_and_spread;
using training::MeanAndSpread;
using training::TrajectoryTest;

std::string between_text(const Equal& equal) {
  return equal.from == equal.to ? "as " + equal.from : fmt::format("between {} and {}", equal.from, equal.to);
}

/// " (2.1 to 3.4)"
std::string interval_text(const PairedRatio& ratio) {
  return ratio.has_interval() ? fmt::format(" ({:.3g} to {:.3g})", ratio.low, ratio.high) : "";
}

Json ratio_json(const PairedRatio& ratio) {
  if (ratio.runs == 0) return nullptr;
  const bool has = ratio.has_interval();
  return {{"mean", json_number(ratio.mean)},
          {"low", has ? json_number(ratio.low) : Json(nullptr)},
          {"high", has ? json_number(ratio.high) : Json(nullptr)},
          {"runs", ratio.runs},
          {"seeds", ratio.seeds}};
}

std::string cost_text(const training::Investment& spent) {
  const auto one = [](const char* what, double seconds) {
    return std::isnan(seconds) ? fmt::format("the cost of the {} is not known and left out", what)
                               : fmt::format("{} of a processor's time for the {}", human_seconds(seconds), what);
  };
  std::string text = one("data", spent.data_s) + ", " + one("training", spent.training_s);
  if (spent.trials > 1 && !std::isnan(spent.training_s))
    text += fmt::format("; all {} trainings took {}", spent.trials, human_seconds(spent.trials * spent.training_s));
  return text;
}

class Comparison : private BesideFigures {
 public:
  Comparison(Report& report, const OneTest& test) : BesideFigures(test), report_(report) {}

  void report(Json& json) {
    json["cost_s"] = json_number(cost_);
    if (!json.contains("beside")) json["beside"] = Json::object();  // for a correlation it already has its times
    say_own_row();
    for (std::size_t s = 0; s < beside_.size(); ++s) report_scene(s, json["beside"]);
    say_others();
    say_of_what();
    report_.add(test_.found().name + "_beside.csv", table());
    report_failures(json);
    if (!can_be_compared()) return;
    const Equals all = equals(plain_);
    json["equal_error"] = cost_json(all.cost);
    json["equal_cost"] = error_json(all.error);
    say_equal_error(all.cost);
    say_equal_cost(all.error);
    report_kinds(json);
    say_break_even(all.cost, json);
  }

 private:
  /// Ratios need positive numbers. Reports why a comparison is impossible.
  bool can_be_compared() {
    const auto is_signed = [](const std::vector<double>& errors) {
      return std::ranges::any_of(errors, [](double error) { return error < 0; });
    };
    if (std::ranges::any_of(own_, is_signed) || std::ranges::any_of(beside_, is_signed)) {
      report_.say(fmt::format("  {} has negative values and is no error to compare by: take its size, abs(...)\n",
                              test_.found().name));
      return false;
    }
    if (plain_.empty() && std::ranges::any_of(*test_.beside, &TrajectoryTest::made_data))
      report_.say("  no plain scheme is left to compare with: those here give these data but for rounding\n");
    if (!plain_.empty() && !std::isfinite(error_))
      report_.say("  the network blows up: no plain scheme is compared with it\n");
    return !plain_.empty() && std::isfinite(error_) && std::isfinite(cost_);
  }

  // ---- rows -------------------------------------------------------------------------------------------------------

  void say_row(const TrajectoryTest& each, double cost, const std::string& rest) {
    const std::string time = std::isfinite(cost) ? human_seconds(cost) + " a unit of time" : "blows up";
    const char* maker = each.made_data ? "; it gives these data but for rounding, and is left out of what follows" : "";
    const std::string staying = is_time_ ? staying_text(each) : "";
    report_.say(fmt::format("  {}: {} on {}{}, {}{}{}\n", each.scene, text_of(mean_and_spread(figures_of(each))),
                            each.file, staying, time, rest, maker));
    if (!test_.is_chart && each.is_named) say_solves(report_, each);
  }

  /// Mean over the trials, like all ratios.
  void say_own_row() {
    const TrajectoryTest& found = test_.found();
    const std::string cost = std::isfinite(cost_) ? human_seconds(cost_) + " a unit of time" : "blows up";
    if (!test_.has_trials() && !is_time_) return say_row(found, cost_, "");
    std::vector<double> means;
    for (const TrajectoryTest* trial : test_.trials) means.push_back(mean_and_spread(figures_of(*trial)).mean);
    if (test_.has_trials())
      report_.say(fmt::format("  {}: {} over {} trials on {}, {}\n", found.scene, text_of(mean_and_spread(means)),
                              means.size(), found.file, cost));
    else
      report_.say(fmt::format("  {}: {}\n", found.scene, cost));  // the rest was reported above
    if (!test_.is_chart) say_solves(report_, found);
  }

  std::string ratio_text(std::size_t s, const PairedRatio& ratio) const {
    if (!is_paired(s)) return fmt::format("; the runs of {} are others: no ratio", scene(s).file);
    if (ratio.runs == 0) return "";
    return is_time_ ? fmt::format("; the network's lasts {:.3g} times as long{}", ratio.mean, interval_text(ratio))
                    : fmt::format("; {:.3g} times the network's{}", ratio.mean, interval_text(ratio));
  }

  void report_scene(std::size_t s, Json& all) {
    const TrajectoryTest& each = scene(s);
    const double cost = test_.costs[s + 1];
    const PairedRatio ratio = error_ratio(s);
    if (each.is_named || front_.contains(each.scene)) say_row(each, cost, each.made_data ? "" : ratio_text(s, ratio));
    if (each.is_named && !test_.is_chart) say_blow_up(report_, each);
    Json json = json_of(figures_of(each));
    json["course"] = json_numbers(each.course());
    if (!each.solves.empty()) json["solves"] = report::json_of(each.solves);
    json.update({{"file", each.file},
                 {"network", each.has_network},
                 {"made_data", each.made_data},
                 {"named", each.is_named},
                 {"paired", is_paired(s)},
                 {"kind", each.method_kind},
                 {"ratio", ratio_json(ratio)},
                 {"cost_s", json_number(cost)}});
    all[each.scene].update(json);
  }

  /// Summarises the automatically added plain methods that are not on the Pareto front.
  void say_others() {
    int others = 0, blown_up = 0;
    for (std::size_t s = 0; s < beside_.size(); ++s) {
      if (scene(s).is_named || front_.contains(scene(s).scene)) continue;
      std::isfinite(error_of(scene(s))) && error_of(scene(s)) > 0 ? ++others : ++blown_up;
    }
    if (others > 0)
      report_.say(fmt::format("  {} other plain methods are dearer and worse than one of these\n", others));
    if (blown_up > 0) report_.say(fmt::format("  {} other plain methods blow up\n", blown_up));
  }

  /// Explains the intervals, or why there are none.
  void say_of_what() {
    bool has_ratio = false;
    for (std::size_t s = 0; s < beside_.size(); ++s)
      has_ratio = has_ratio || (!scene(s).made_data && error_ratio(s).runs > 0);
    if (!has_ratio) return;
    const auto runs = own_[0].size(), seeds = own_.size();
    if (runs < 2 && seeds < 2) {
      report_.say("  one run and one seed: nothing tells how far these ratios would be others with other ones\n");
      return;
    }
    const std::string of = seeds < 2  ? fmt::format("{} runs, with one seed of the training", runs)
                           : runs < 2 ? fmt::format("{} seeds, with one run: other runs may give other ratios", seeds)
                                      : fmt::format("{} runs and {} seeds", runs, seeds);
    report_.say(fmt::format("  ratios are paired by run, geometric means with intervals of 95 %, over {}\n", of));
  }

  std::string table() const {
    std::string text =
        "scene,file,network,mean,spread,cost_s,named,kind,ratio,ratio_low,ratio_high,solves,iterations,solve_s";
    std::size_t most_runs = own_[0].size();
    for (const std::vector<double>& errors : beside_) most_runs = std::max(most_runs, errors.size());
    for (std::size_t run = 0; run < most_runs; ++run) text += fmt::format(",run_{}", run);
    text += "\n";
    const auto add = [&](const TrajectoryTest& each, double cost, const PairedRatio& ratio) {
      const MeanAndSpread whole = mean_and_spread(figures_of(each));
      SolveNote all;
      for (const driver::SolveReport& solve : each.solves) {
        all.solves += solve.note.solves;
        all.iterations += solve.note.iterations;
        all.seconds += solve.note.seconds;
      }
      text += fmt::format("\"{}\",{},{},{},{},{},{},\"{}\",{},{},{},{},{},{}", each.scene, each.file,
                          each.has_network ? 1 : 0, whole.mean, whole.spread, cost, each.is_named ? 1 : 0,
                          each.method_kind, ratio.mean, ratio.low, ratio.high, all.solves, all.iterations, all.seconds);
      const std::vector<double> figures = figures_of(each);
      for (std::size_t run = 0; run < most_runs; ++run)
        text += run < figures.size() ? fmt::format(",{}", figures[run]) : ",";
      text += "\n";
    };
    add(test_.found(), cost_, {1, 1, 1, 0, 0});
    for (std::size_t s = 0; s < beside_.size(); ++s) add(scene(s), test_.costs[s + 1], error_ratio(s));
    return text;
  }

  // ---- equal error, equal time ------------------------------------------------------------------------------------

  static Json equal_json(const EqualPoint& point, const PairedRatio& by_run, const char* key, double value,
                         double own) {
    if (point.of_means.kind == Equal::Kind::beyond_all) return nullptr;
    return {{key, json_number(value)},
            {"ratio", json_number(value / own)},
            {"between", {point.of_means.from, point.of_means.to}},
            {"beyond", point.of_means.kind == Equal::Kind::within_all},
            {"paired", ratio_json(by_run)},
            {"runs_beyond", point.runs_beyond},
            {"runs_within", point.runs_within}};
  }
  Json cost_json(const EqualPoint& point) const {
    return equal_json(point, point.by_run, "cost_s", point.of_means.value, cost_);
  }
  /// For durations: ratio of the plain schemes' duration to the network's.
  Json error_json(const EqualPoint& point) const {
    if (!is_time_) return equal_json(point, point.by_run, "error", point.of_means.value, error_);
    const PairedRatio& of = point.by_run;
    const PairedRatio inverse{1 / of.mean, 1 / of.high, 1 / of.low, of.runs, of.seeds};
    return equal_json(point, inverse, "time", figure_of(point.of_means.value), figure_of(error_));
  }

  /// Ratio over runs and seeds. `beyond`, `within`: texts for runs without a ratio.
  std::string by_run_text(const EqualPoint& point, const char* beyond, const char* within) const {
    const auto runs = own_[0].size();
    std::string text;
    if (point.by_run.runs > 0) return fmt::format("; by run {:.3g}{}", point.by_run.mean, interval_text(point.by_run));
    if (point.runs_beyond > 0) text += fmt::format("; in {} of {} runs {}", point.runs_beyond, runs, beyond);
    if (point.runs_within > 0) text += fmt::format("; in {} of {} runs {}", point.runs_within, runs, within);
    return text;
  }
  std::string cost_by_run(const EqualPoint& point) const {
    return by_run_text(point, "none reaches it", "even the cheapest one is better");
  }
  std::string error_by_run(const EqualPoint& point) const { return by_run_text(point, "none is as cheap", ""); }
  /// "its err of 0.08", "its time of 5.1"
  std::string own_text() const { return fmt::format("its {} of {:.4g}", test_.found().name, shown(figure_of(error_))); }
  const char* schemes_text() const {
    const bool only_named = std::ranges::all_of(*test_.beside, &TrajectoryTest::is_named);
    return only_named ? "plain schemes named" : "plain schemes";
  }
  std::string much_text(double times) const {
    return is_time_ ? fmt::format("the network's lasts {:.3g} times as long", times)
                    : fmt::format("{:.3g} times as much", times);
  }

  void say_equal_error(const EqualPoint& point) {
    const Equal& equal = point.of_means;
    const std::string took =
        fmt::format("{} a unit of time, {:.3g} times as long", human_seconds(equal.value), equal.value / cost_);
    switch (equal.kind) {
      case Equal::Kind::found:
        report_.say(fmt::format("  for {} plain schemes take {} ({}){}\n", own_text(), took, between_text(equal),
                                cost_by_run(point)));
        return;
      case Equal::Kind::beyond_all:
        report_.say(fmt::format("  for {}: none of the {} reaches it\n", own_text(), schemes_text()));
        return;
      case Equal::Kind::within_all:
        report_.say(fmt::format("  for {}: the cheapest plain scheme is better, and takes {}\n", own_text(), took));
        return;
    }
  }

  void say_equal_cost(const EqualPoint& point) {
    const Equal& equal = point.of_means;
    const double value = figure_of(equal.value);
    const std::string much = much_text(equal.value / error_);
    switch (equal.kind) {
      case Equal::Kind::found:
        report_.say(fmt::format("  for its time plain schemes have {} = {:.4g}, {} ({}){}\n", test_.found().name, value,
                                much, between_text(equal), error_by_run(point)));
        return;
      case Equal::Kind::beyond_all:
        report_.say(fmt::format("  for its time: none of the {} is as cheap\n", schemes_text()));
        return;
      case Equal::Kind::within_all:
        report_.say(fmt::format("  for its time: the most accurate plain scheme takes less, with {} = {:.4g}, {}\n",
                                test_.found().name, value, much));
        return;
    }
  }

  /// The mean ratio over runs if all runs have one, else the ratio of means.
  static std::string ratio_of(const EqualPoint& point, double of_means) {
    return point.by_run.runs > 0 ? fmt::format("{:.3g}{}", point.by_run.mean, interval_text(point.by_run))
                                 : fmt::format("{:.3g}", of_means);
  }

  /// Reports the best method of each kind.
  void report_kinds(Json& json) {
    std::set<std::string> kinds;
    for (const std::size_t s : plain_) kinds.insert(scene(s).method_kind);
    json["kinds"] = Json::object();
    for (const std::string& kind : kinds) {
      std::vector<std::size_t> of_kind;
      std::ranges::copy_if(plain_, std::back_inserter(of_kind),
                           [&](std::size_t s) { return scene(s).method_kind == kind; });
      const Equals all = equals(of_kind);
      json["kinds"][kind] = {{"equal_error", cost_json(all.cost)}, {"equal_cost", error_json(all.error)}};
      if (kinds.size() < 2) continue;
      const Equal &at_error = all.cost.of_means, &at_cost = all.error.of_means;
      const std::string ratio = ratio_of(all.error, at_cost.value / error_),
                        time = at_error.kind == Equal::Kind::beyond_all ? "none is as good"
                               : at_error.kind == Equal::Kind::within_all
                                   ? fmt::format("better in {:.3g} times its time", at_error.value / cost_)
                                   : ratio_of(all.cost, at_error.value / cost_) + " times as long",
                        error = at_cost.kind == Equal::Kind::beyond_all ? "none is as cheap"
                                : is_time_ ? "the network's lasts " + ratio + " times as long"
                                           : "for its time " + ratio + " times the error";
      report_.say(fmt::format("    {}: {}; {}\n", kind, time, error));
    }
  }

  /// Reports runs in which the network blows up, or a plain scheme of at most the same cost is better.
  void report_failures(Json& json) {
    std::vector<std::size_t> blown_up, worse;
    for (std::size_t run = 0; run < own_[0].size(); ++run) {
      const auto is_lost = [&](const std::vector<double>& trial) { return !std::isfinite(trial[run]); };
      if (std::ranges::any_of(own_, is_lost)) {
        blown_up.push_back(run);
        continue;
      }
      const auto is_beaten = [&](std::size_t s) {
        return test_.costs[s + 1] <= cost_ && is_paired(s) &&
               std::ranges::any_of(own_, [&](const auto& trial) { return beside_[s][run] < trial[run]; });
      };
      if (std::ranges::any_of(plain_, is_beaten)) worse.push_back(run);
    }
    json["failures"] = {{"blown_up", blown_up}, {"worse", worse}};
    if (!blown_up.empty())
      report_.say(fmt::format("  the network blows up in {} of {} runs ({})\n", blown_up.size(), own_[0].size(),
                              fmt::join(blown_up, ", ")));
    if (!worse.empty())
      report_.say(fmt::format("  in {} of {} runs a plain scheme of no more time is better than it ({})\n",
                              worse.size(), own_[0].size(), fmt::join(worse, ", ")));
  }

  /// Number of runs, each as long as the test, after which the cost of data and training is recovered.
  void say_break_even(const EqualPoint& point, Json& json) {
    const Equal& at_error = point.of_means;
    const training::Investment& spent = *test_.spent;
    const bool knows_data = !std::isnan(spent.data_s), knows_training = !std::isnan(spent.training_s);
    const double length = test_.found().times.back(),
                 sum = (knows_data ? spent.data_s : 0) + (knows_training ? spent.training_s : 0);
    using When = analysis::BreakEven::Kind;
    const analysis::BreakEven even = break_even(at_error, cost_, length, sum);
    const bool has_number = knows_data && knows_training && even.kind == When::after;
    json["break_even"] = {{"runs", has_number ? json_number(std::ceil(even.runs)) : Json(nullptr)},
                          {"never", even.kind == When::never},
                          {"length", length},
                          {"data_s", knows_data ? Json(spent.data_s) : Json(nullptr)},
                          {"training_s", knows_training ? Json(spent.training_s) : Json(nullptr)},
                          {"all_trainings_s", knows_training ? Json(spent.training_s * spent.trials) : Json(nullptr)}};
    if (even.kind == When::never) {
      report_.say("  data and training never pay for themselves: plain schemes are as good in no more time\n");
    } else if (even.kind == When::unknown) {
      report_.say("  whether data and training pay for themselves is not known: no plain scheme is as good\n");
    } else if (!knows_data && !knows_training) {
      report_.say(
          "  after how many runs data and training pay for themselves is not known: neither file tells what they "
          "cost\n");
    } else {
      const std::string doubt = point.is_of_all_runs() ? "" : ", by the means alone: not every run has such a scheme";
      report_.say(
          fmt::format("  data and training pay for themselves after {:.4g} runs{} of {:.4g} units of time ({}){}\n",
                      std::ceil(even.runs), runs_between(point, length, sum), length, cost_text(spent), doubt));
    }
  }

  /// " (80 to 300)": at the ends of the ratio's interval.
  std::string runs_between(const EqualPoint& point, double length, double spent) const {
    if (!point.by_run.has_interval()) return "";
    const auto runs = [&](double ratio) { return std::ceil(spent / (length * cost_ * (ratio - 1))); };
    const std::string last = point.by_run.low > 1 ? fmt::format("{:.4g}", runs(point.by_run.low)) : "never";
    return point.by_run.high > 1 ? fmt::format(" ({:.4g} to {})", runs(point.by_run.high), last) : "";
  }

  Report& report_;
};

}  // namespace

void report_beside(Report& report, const OneTest& test, Json& json) {
  if (!test.beside->empty()) Comparison(report, test).report(json);
}

}  // namespace dpde::report
