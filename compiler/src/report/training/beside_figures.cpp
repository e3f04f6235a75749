// SPDX-License-Identifier: Apache-2.0
#include "report/training/beside_figures.h"

#include <algorithm>
#include <cmath>

namespace dpde::report {

using analysis::Equal;
using analysis::PairedRatio;
using training::mean_and_spread;
using training::TrajectoryTest;

namespace {

PairedRatio no_ratio() { return {std::nan(""), std::nan(""), std::nan(""), 0, 0}; }

}  // namespace

BesideFigures::BesideFigures(const OneTest& test)
    : test_(test), is_time_(test.start->kind == model::Test::Kind::correlation) {
  for (const TrajectoryTest* trial : test.trials) own_.push_back(trial->errors());
  for (const TrajectoryTest& beside : *test.beside) beside_.push_back(beside.errors());
  cost_ = test.costs[0];
  std::vector<double> means;
  for (const TrajectoryTest* trial : test.trials) means.push_back(mean_and_spread(figures_of(*trial)).mean);
  error_ = figure_of(mean_and_spread(means).mean);
  for (std::size_t s = 0; s < beside_.size(); ++s) {
    if (is_plain(s)) plain_.push_back(s);
  }
  for (const analysis::CostAndError& best : analysis::best_of(costs_and_errors(plain_))) front_.insert(best.scene);
}

std::vector<double> BesideFigures::figures_of(const TrajectoryTest& test) const {
  std::vector<double> figures = test.errors();
  for (double& figure : figures) figure = figure_of(figure);
  return figures;
}

double BesideFigures::error_of(const TrajectoryTest& test) const {
  return figure_of(mean_and_spread(figures_of(test)).mean);
}

std::vector<analysis::CostAndError> BesideFigures::costs_and_errors(const std::vector<std::size_t>& scenes) const {
  std::vector<analysis::CostAndError> all;
  for (const std::size_t s : scenes) all.push_back({scene(s).scene, test_.costs[s + 1], error_of(scene(s))});
  return all;
}

template <class Ratio>
PairedRatio BesideFigures::paired(const Ratio& ratio) const {
  std::vector<std::vector<double>> all;
  for (const std::vector<double>& trial : own_) {
    std::vector<double>& of_trial = all.emplace_back();
    for (std::size_t run = 0; run < trial.size(); ++run) of_trial.push_back(ratio(trial[run], run));
  }
  const PairedRatio found = analysis::paired_ratio(all);
  return found.runs == std::ssize(own_[0]) ? found : no_ratio();
}

PairedRatio BesideFigures::error_ratio(std::size_t s) const {
  if (!is_paired(s)) return no_ratio();
  return paired([&](double own, std::size_t run) { return beside_[s][run] / own; });
}

/// Mean of find(schemes, network's error) over `unit(error)`, for the schemes in each run. `takes_within`: also use
/// runs in which even the last scheme is better.
template <class Find, class Unit>
void BesideFigures::look_at_runs(const std::vector<std::size_t>& schemes, bool takes_within, const Find& find,
                                 const Unit& unit, EqualPoint& point) const {
  std::set<std::size_t> beyond, within;
  point.by_run = paired([&](double own, std::size_t run) {
    std::vector<analysis::CostAndError> of_run;
    for (const std::size_t s : schemes) of_run.push_back({scene(s).scene, test_.costs[s + 1], beside_[s][run]});
    const Equal equal = find(of_run, own);
    const bool is_within = equal.kind == Equal::Kind::within_all && !takes_within;
    if (equal.kind == Equal::Kind::beyond_all) beyond.insert(run);
    if (is_within) within.insert(run);
    return is_within || equal.kind == Equal::Kind::beyond_all ? std::nan("") : equal.value / unit(own);
  });
  point.runs_beyond = static_cast<int>(beyond.size());
  point.runs_within = static_cast<int>(within.size());
}

Equals BesideFigures::equals(const std::vector<std::size_t>& scenes) const {
  const std::vector<analysis::CostAndError> means = costs_and_errors(scenes);
  Equals all{{cost_of_equal_error(means, error_)}, {error_of_equal_cost(means, cost_)}};
  std::vector<std::size_t> best;
  bool are_paired = true;
  for (const analysis::CostAndError& each : analysis::best_of(means)) {
    best.push_back(*std::ranges::find_if(scenes, [&](std::size_t s) { return scene(s).scene == each.scene; }));
    are_paired = are_paired && is_paired(best.back());
  }
  all.cost.by_run = all.error.by_run = no_ratio();
  if (!are_paired) return all;
  look_at_runs(
      best, false, analysis::cost_of_equal_error, [&](double) { return cost_; }, all.cost);
  const auto at_cost = [&](const auto& schemes, double) { return error_of_equal_cost(schemes, cost_); };
  look_at_runs(
      best, true, at_cost, [](double own) { return own; }, all.error);
  return all;
}

}  // namespace dpde::report
