// SPDX-License-Identifier: Apache-2.0
#include "beside_output.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/comparison.h"
#include "analysis/paired_ratio.h"
#include "support/evaluate.h"

namespace dpde::tools {

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

std::string cost_text(const Investment& spent) {
  const auto one = [](const char* what, double seconds) {
    return std::isnan(seconds) ? fmt::format("the cost of the {} is not known and left out", what)
                               : fmt::format("{} of a processor's time for the {}", human_seconds(seconds), what);
  };
  std::string text = one("data", spent.data_s) + ", " + one("training", spent.training_s);
  if (spent.trials > 1 && !std::isnan(spent.training_s))
    text += fmt::format("; all {} trainings took {}", spent.trials, human_seconds(spent.trials * spent.training_s));
  return text;
}

/// What plain schemes take for the network's figure, and have for its time; the same of each run and seed.
struct Equals {
  Equal at_error, at_cost;
  PairedRatio cost, error;  // of costs at equal error, of errors at equal cost
};

class Comparison {
 public:
  Comparison(Job& job, const OneTest& test)
      : job_(job), test_(test), is_time_(test.start->kind == model::Test::Kind::correlation) {
    for (const TrajectoryTest* trial : test.trials) own_.push_back(trial->errors());
    for (const TrajectoryTest& beside : *test.beside) beside_.push_back(beside.errors());
    cost_ = test.costs[0];
    error_ = error_of_mean();
    for (std::size_t s = 0; s < beside_.size(); ++s) {
      if (is_plain(s)) plain_.push_back(s);
    }
    for (const analysis::CostAndError& best : analysis::best_of(costs_and_errors(plain_))) front_.insert(best.scene);
  }

  void report(Json& json) {
    json["cost_s"] = json_number(cost_);
    json["beside"] = Json::object();
    if (is_time_)  // which is said above
      job_.say(fmt::format("  {}: {} a unit of time\n", test_.found().scene, human_seconds(cost_)));
    else
      say_row(test_.found(), cost_, "");
    for (std::size_t s = 0; s < beside_.size(); ++s) report_scene(s, json["beside"]);
    say_others();
    say_of_what();
    if (!job_.options().out.empty()) save_text(job_, test_.found().name + "_beside.csv", table());
    if (plain_.empty() || !std::isfinite(error_)) return;
    const Equals all = equals(plain_);
    json["equal_error"] = equal_json(all.at_error, all.cost, "cost_s", cost_);
    json["equal_cost"] = equal_json(all.at_cost, all.error, is_time_ ? "time" : "error", figure_of(error_));
    say_equal_error(all);
    say_equal_cost(all);
    report_kinds(json);
    report_failures(json);
    say_break_even(all.at_error, json);
  }

 private:
  /// And back.
  double figure_of(double error) const { return is_time_ ? 1 / error : error; }

  std::vector<double> figures_of(const TrajectoryTest& test) const {
    std::vector<double> figures = test.errors();
    for (double& figure : figures) figure = figure_of(figure);
    return figures;
  }
  double error_of(const TrajectoryTest& test) const { return figure_of(mean_and_spread(figures_of(test)).mean); }
  /// Over trials and runs.
  double error_of_mean() const {
    std::vector<double> figures;
    for (const TrajectoryTest* trial : test_.trials) figures.push_back(mean_and_spread(figures_of(*trial)).mean);
    return figure_of(mean_and_spread(figures).mean);
  }

  const TrajectoryTest& scene(std::size_t s) const { return (*test_.beside)[s]; }
  bool is_plain(std::size_t s) const { return !scene(s).has_network && !scene(s).made_data; }

  std::vector<analysis::CostAndError> costs_and_errors(const std::vector<std::size_t>& scenes) const {
    std::vector<analysis::CostAndError> all;
    for (const std::size_t s : scenes) all.push_back({scene(s).scene, test_.costs[s + 1], error_of(scene(s))});
    return all;
  }

  /// ratio(trial, run) of all of them.
  template <class Ratio>
  PairedRatio paired(const Ratio& ratio) const {
    std::vector<std::vector<double>> all;
    for (const std::vector<double>& trial : own_) {
      std::vector<double>& of_trial = all.emplace_back();
      for (std::size_t run = 0; run < trial.size(); ++run) of_trial.push_back(ratio(trial[run], run));
    }
    return analysis::paired_ratio(all);
  }
  /// By how much the error of a scene is larger.
  PairedRatio error_ratio(std::size_t s) const {
    if (beside_[s].size() != own_[0].size()) return {std::nan(""), std::nan(""), std::nan(""), 0, 0};
    return paired([&](double own, std::size_t run) { return beside_[s][run] / own; });
  }

  /// Of these scenes: in the mean, and of each run by those that are the best in the mean, chosen before any run is
  /// looked at.
  Equals equals(const std::vector<std::size_t>& scenes) const {
    const std::vector<analysis::CostAndError> means = costs_and_errors(scenes);
    Equals all{cost_of_equal_error(means, error_), error_of_equal_cost(means, cost_), {}, {}};
    std::vector<std::size_t> best;
    for (const analysis::CostAndError& each : analysis::best_of(means)) {
      const auto at = std::ranges::find_if(scenes, [&](std::size_t s) { return scene(s).scene == each.scene; });
      if (beside_[*at].size() == own_[0].size()) best.push_back(*at);
    }
    const auto of_run = [&](std::size_t run) {
      std::vector<analysis::CostAndError> one;
      for (const std::size_t s : best) one.push_back({scene(s).scene, test_.costs[s + 1], beside_[s][run]});
      return one;
    };
    all.cost = paired([&](double own, std::size_t run) {
      const Equal equal = cost_of_equal_error(of_run(run), own);
      return equal.kind == Equal::Kind::found ? equal.value / cost_ : std::nan("");
    });
    all.error = paired([&](double own, std::size_t run) {
      const Equal equal = error_of_equal_cost(of_run(run), cost_);
      return equal.kind == Equal::Kind::beyond_all ? std::nan("") : equal.value / own;
    });
    return all;
  }

  // ---- rows
  // ----------------------------------------------------------------------------------------------------------

  void say_row(const TrajectoryTest& each, double cost, const std::string& rest) {
    const std::string time = std::isfinite(cost) ? human_seconds(cost) + " a unit of time" : "blows up";
    const char* maker = each.made_data ? "; it made the data, and is left out of what follows" : "";
    const std::string staying = is_time_ ? staying_text(each) : "";
    job_.say(fmt::format("  {}: {} on {}{}, {}{}{}\n", each.scene, text_of(mean_and_spread(figures_of(each))),
                         each.file, staying, time, rest, maker));
  }

  std::string ratio_text(const PairedRatio& ratio) const {
    if (ratio.runs == 0) return "";
    return is_time_ ? fmt::format("; the network's lasts {:.3g} times as long{}", ratio.mean, interval_text(ratio))
                    : fmt::format("; {:.3g} times the network's{}", ratio.mean, interval_text(ratio));
  }

  void report_scene(std::size_t s, Json& all) {
    const TrajectoryTest& each = scene(s);
    const double cost = test_.costs[s + 1];
    const PairedRatio ratio = error_ratio(s);
    if (each.is_named || front_.contains(each.scene)) say_row(each, cost, each.made_data ? "" : ratio_text(ratio));
    if (each.is_named && !test_.is_chart) say_blow_up(job_, each);
    Json json = json_of(figures_of(each));
    json["course"] = json_numbers(each.course());
    if (!each.solves.empty()) json["solves"] = tools::json_of(each.solves);
    json.update({{"file", each.file},
                 {"network", each.has_network},
                 {"made_data", each.made_data},
                 {"named", each.is_named},
                 {"kind", each.method_kind},
                 {"ratio", ratio_json(ratio)},
                 {"cost_s", json_number(cost)}});
    all[each.scene].update(json);
  }

  /// Plain methods that nobody named and that are not among the best.
  void say_others() {
    int others = 0, blown_up = 0;
    for (std::size_t s = 0; s < beside_.size(); ++s) {
      if (scene(s).is_named || front_.contains(scene(s).scene)) continue;
      std::isfinite(error_of(scene(s))) && error_of(scene(s)) > 0 ? ++others : ++blown_up;
    }
    if (others > 0) job_.say(fmt::format("  {} other plain methods are dearer and worse than one of these\n", others));
    if (blown_up > 0) job_.say(fmt::format("  {} other plain methods blow up\n", blown_up));
  }

  /// What intervals are of, and whether there is any.
  void say_of_what() {
    const auto runs = own_[0].size(), seeds = own_.size();
    if (runs < 2 && seeds < 2) {
      job_.say("  one run and one seed: nothing tells how far these ratios would be others with other ones\n");
      return;
    }
    const std::string of = seeds > 1 ? fmt::format("{} runs and {} seeds", runs, seeds)
                                     : fmt::format("{} runs, with one seed of the training", runs);
    job_.say(fmt::format("  ratios are paired by run, geometric means with intervals of 95 %, over {}\n", of));
  }

  std::string table() const {
    std::string text =
        "scene,file,network,mean,spread,cost_s,named,kind,ratio,ratio_low,ratio_high,solves,iterations,solve_s\n";
    const auto add = [&](const TrajectoryTest& each, double cost, const PairedRatio& ratio) {
      const MeanAndSpread whole = mean_and_spread(figures_of(each));
      SolveNote all;
      for (const driver::SolveReport& solve : each.solves) {
        all.solves += solve.note.solves;
        all.iterations += solve.note.iterations;
        all.seconds += solve.note.seconds;
      }
      text += fmt::format("\"{}\",{},{},{},{},{},{},\"{}\",{},{},{},{},{},{}\n", each.scene, each.file,
                          each.has_network ? 1 : 0, whole.mean, whole.spread, cost, each.is_named ? 1 : 0,
                          each.method_kind, ratio.mean, ratio.low, ratio.high, all.solves, all.iterations, all.seconds);
    };
    add(test_.found(), cost_, {1, 1, 1, 0, 0});
    for (std::size_t s = 0; s < beside_.size(); ++s) add(scene(s), test_.costs[s + 1], error_ratio(s));
    return text;
  }

  // ---- equal error, equal time
  // ---------------------------------------------------------------------------------------

  static Json equal_json(const Equal& equal, const PairedRatio& paired, const char* key, double own) {
    if (equal.kind == Equal::Kind::beyond_all) return nullptr;
    return {{key, json_number(equal.value)},
            {"ratio", json_number(equal.value / own)},
            {"between", {equal.from, equal.to}},
            {"beyond", equal.kind == Equal::Kind::within_all},
            {"paired", ratio_json(paired)}};
  }

  /// What runs and seeds say of a ratio of means.
  std::string paired_text(const PairedRatio& ratio) const {
    const auto runs = static_cast<int>(own_[0].size());
    if (ratio.runs == runs)
      return ratio.has_interval() ? fmt::format("; by run {:.3g}{}", ratio.mean, interval_text(ratio)) : "";
    return fmt::format("; in {} of {} runs there is such a scheme", ratio.runs, runs);
  }
  /// "its err of 0.08", "its time of 5.1"
  std::string own_text() const { return fmt::format("its {} of {:.4g}", test_.found().name, shown(figure_of(error_))); }

  void say_equal_error(const Equals& all) {
    const Equal& equal = all.at_error;
    const std::string took =
        fmt::format("{} a unit of time, {:.3g} times as long", human_seconds(equal.value), equal.value / cost_);
    switch (equal.kind) {
      case Equal::Kind::found:
        job_.say(fmt::format("  for {} plain schemes take {} ({}){}\n", own_text(), took, between_text(equal),
                             paired_text(all.cost)));
        return;
      case Equal::Kind::beyond_all:
        job_.say(fmt::format("  for {}: none of the plain schemes reaches it\n", own_text()));
        return;
      case Equal::Kind::within_all:
        job_.say(fmt::format("  for {}: the cheapest plain scheme is better, and takes {}\n", own_text(), took));
        return;
    }
  }

  void say_equal_cost(const Equals& all) {
    const Equal& equal = all.at_cost;
    const double value = figure_of(equal.value), times = equal.value / error_;
    const std::string much =
        is_time_ ? fmt::format("{:.3g} times as long", 1 / times) : fmt::format("{:.3g} times as much", times);
    switch (equal.kind) {
      case Equal::Kind::found:
        job_.say(fmt::format("  for its time plain schemes have {} = {:.4g}, {} ({}){}\n", test_.found().name, value,
                             much, between_text(equal), is_time_ ? "" : paired_text(all.error)));
        return;
      case Equal::Kind::beyond_all: job_.say("  for its time: none of the plain schemes is as cheap\n"); return;
      case Equal::Kind::within_all:
        job_.say(fmt::format("  for its time: the dearest plain scheme takes less, with {} = {:.4g}, {}\n",
                             test_.found().name, value, much));
        return;
    }
  }

  /// The best of each kind of method.
  void report_kinds(Json& json) {
    std::set<std::string> kinds;
    for (const std::size_t s : plain_) kinds.insert(scene(s).method_kind);
    json["kinds"] = Json::object();
    for (const std::string& kind : kinds) {
      std::vector<std::size_t> of_kind;
      std::ranges::copy_if(plain_, std::back_inserter(of_kind),
                           [&](std::size_t s) { return scene(s).method_kind == kind; });
      const Equals all = equals(of_kind);
      json["kinds"][kind] = {{"equal_error", equal_json(all.at_error, all.cost, "cost_s", cost_)},
                             {"equal_cost", equal_json(all.at_cost, all.error, "error", error_)}};
      if (kinds.size() < 2) continue;
      const std::string time = all.at_error.kind == Equal::Kind::beyond_all
                                   ? "none as good"
                                   : fmt::format("{}{:.3g} times as long{}",
                                                 all.at_error.kind == Equal::Kind::within_all ? "at most " : "",
                                                 all.at_error.value / cost_, interval_text(all.cost)),
                        error = all.at_cost.kind == Equal::Kind::beyond_all
                                    ? "none as cheap"
                                    : fmt::format("{:.3g} times {}{}", all.at_cost.value / error_,
                                                  is_time_ ? "as short" : "the error", interval_text(all.error));
      job_.say(fmt::format("    {}: {}; for its time {}\n", kind, time, error));
    }
  }

  /// Runs in which the network blows up, or a plain scheme of no more time is better.
  void report_failures(Json& json) {
    std::vector<std::size_t> blown_up, worse;
    for (std::size_t run = 0; run < own_[0].size(); ++run) {
      const auto is_lost = [&](const std::vector<double>& trial) { return !std::isfinite(trial[run]); };
      if (std::ranges::any_of(own_, is_lost)) {
        blown_up.push_back(run);
        continue;
      }
      const auto is_beaten = [&](std::size_t s) {
        return test_.costs[s + 1] <= cost_ && run < beside_[s].size() &&
               std::ranges::any_of(own_, [&](const auto& trial) { return beside_[s][run] < trial[run]; });
      };
      if (std::ranges::any_of(plain_, is_beaten)) worse.push_back(run);
    }
    json["failures"] = {{"blown_up", blown_up}, {"worse", worse}};
    if (!blown_up.empty())
      job_.say(fmt::format("  the network blows up in {} of {} runs ({})\n", blown_up.size(), own_[0].size(),
                           fmt::join(blown_up, ", ")));
    if (!worse.empty())
      job_.say(fmt::format("  in {} of {} runs a plain scheme of no more time is better than it ({})\n", worse.size(),
                           own_[0].size(), fmt::join(worse, ", ")));
  }

  /// After how many runs as long as the test's data and training are earned.
  void say_break_even(const Equal& at_error, Json& json) {
    const Investment& spent = *test_.spent;
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
      job_.say("  data and training never pay for themselves: plain schemes have this error in no more time\n");
    } else if (even.kind == When::unknown) {
      job_.say(
          "  whether data and training pay for themselves is not known: none of the plain schemes has this error\n");
    } else if (!knows_data && !knows_training) {
      job_.say(
          "  after how many runs data and training pay for themselves is not known: neither file tells what they "
          "cost\n");
    } else {
      job_.say(fmt::format("  data and training pay for themselves after {:.4g} runs of {:.4g} units of time ({})\n",
                           std::ceil(even.runs), length, cost_text(spent)));
    }
  }

  Job& job_;
  const OneTest& test_;
  bool is_time_;                                   // figures are times that correlations last, errors one over them
  std::vector<std::vector<double>> own_, beside_;  // errors: by trial or scene, then run
  double cost_ = 0, error_ = 0;                    // the network's
  std::vector<std::size_t> plain_;
  std::set<std::string> front_;  // titles
};

}  // namespace

void report_beside(Job& job, const OneTest& test, Json& json) {
  if (!test.beside->empty()) Comparison(job, test).report(json);
}

}  // namespace dpde::tools
