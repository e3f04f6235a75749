// SPDX-License-Identifier: Apache-2.0
// Numbers for comparing a network with other scenes, run by run.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "analysis/certificate/comparison.h"
#include "analysis/certificate/paired_ratio.h"
#include "report/training/one_test.h"

namespace dpde::report {

/// A number from means over the runs, and its mean over runs and seeds; the latter is missing if one of them has no
/// number.
struct EqualPoint {
  analysis::Equal of_means;
  analysis::PairedRatio by_run;  // relative to the network
  int runs_beyond = 0;           // runs in which, for at least one seed, no scheme reaches the network's value
  int runs_within = 0;           // the same; even the last scheme is better

  bool is_of_all_runs() const { return runs_beyond == 0 && runs_within == 0; }
};
/// Cost of plain schemes at the network's error, and their error at its cost.
struct Equals {
  EqualPoint cost, error;
};

class BesideFigures {
 public:
  explicit BesideFigures(const OneTest& test);

  /// Scenes are compared by errors, the smaller the better. For a correlation the reported figure is a duration, and
  /// the error is its reciprocal. This converts in both directions.
  double figure_of(double error) const { return is_time_ ? 1 / error : error; }
  std::vector<double> figures_of(const training::TrajectoryTest& test) const;
  double error_of(const training::TrajectoryTest& test) const;

  const training::TrajectoryTest& scene(std::size_t s) const { return (*test_.beside)[s]; }
  bool is_paired(std::size_t s) const { return scene(s).has_runs_of(test_.found()); }
  bool is_plain(std::size_t s) const { return !scene(s).has_network && !scene(s).made_data; }

  /// Ratio of a scene's error to the network's.
  analysis::PairedRatio error_ratio(std::size_t s) const;
  /// Comparison with these scenes: by means, and for each run with the Pareto front of the means, which is chosen
  /// without knowledge of single runs.
  Equals equals(const std::vector<std::size_t>& scenes) const;

 protected:
  std::vector<analysis::CostAndError> costs_and_errors(const std::vector<std::size_t>& scenes) const;

  const OneTest& test_;
  bool is_time_;                                   // figures are durations of correlations
  std::vector<std::vector<double>> own_, beside_;  // errors: by trial or scene, then run
  double cost_ = 0, error_ = 0;                    // of the network, over trials and runs
  std::vector<std::size_t> plain_;
  std::set<std::string> front_;  // titles of the plain scenes on the Pareto front

 private:
  /// Mean of ratio(trial, run) over all; none if one of them is missing, since the rest would be selected by the
  /// result.
  template <class Ratio>
  analysis::PairedRatio paired(const Ratio& ratio) const;
  template <class Find, class Unit>
  void look_at_runs(const std::vector<std::size_t>& schemes, bool takes_within, const Find& find, const Unit& unit,
                    EqualPoint& point) const;
};

}  // namespace dpde::report
