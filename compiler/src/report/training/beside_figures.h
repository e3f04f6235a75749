// SPDX-License-Identifier: Apache-2.0
// The numbers by which a network is compared with the scenes beside it, run by run.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "analysis/certificate/comparison.h"
#include "analysis/certificate/paired_ratio.h"
#include "report/training/one_test.h"

namespace dpde::report {

/// One number of means over the runs, and the same of each run and seed: without a mean where one of them has none.
struct EqualPoint {
  analysis::Equal of_means;
  analysis::PairedRatio by_run;  // over the network's own
  int runs_beyond = 0;           // in which, for a seed at least, no scheme reaches so far
  int runs_within = 0;           // the same, even the last one reaches farther

  bool is_of_all_runs() const { return runs_beyond == 0 && runs_within == 0; }
};
/// What plain schemes take for the network's figure, and have for its time.
struct Equals {
  EqualPoint cost, error;
};

class BesideFigures {
 public:
  explicit BesideFigures(const OneTest& test);

  /// What scenes are compared by is the smaller the better; of a correlation it is one over the time that is told. And
  /// back.
  double figure_of(double error) const { return is_time_ ? 1 / error : error; }
  std::vector<double> figures_of(const training::TrajectoryTest& test) const;
  double error_of(const training::TrajectoryTest& test) const;

  const training::TrajectoryTest& scene(std::size_t s) const { return (*test_.beside)[s]; }
  bool is_paired(std::size_t s) const { return scene(s).has_runs_of(test_.found()); }
  bool is_plain(std::size_t s) const { return !scene(s).has_network && !scene(s).made_data; }

  /// By how much the error of a scene is larger.
  analysis::PairedRatio error_ratio(std::size_t s) const;
  /// Of these scenes: in the mean, and of each run by those that are the best in the mean, chosen before any run is
  /// looked at.
  Equals equals(const std::vector<std::size_t>& scenes) const;

 protected:
  std::vector<analysis::CostAndError> costs_and_errors(const std::vector<std::size_t>& scenes) const;

  const OneTest& test_;
  bool is_time_;                                   // figures are times that correlations last
  std::vector<std::vector<double>> own_, beside_;  // errors: by trial or scene, then run
  double cost_ = 0, error_ = 0;                    // the network's, over trials and runs
  std::vector<std::size_t> plain_;
  std::set<std::string> front_;  // titles of the plain scenes that are the best for their time

 private:
  /// ratio(trial, run) of all of them; none where one of them has none: what is left would be chosen by the result.
  template <class Ratio>
  analysis::PairedRatio paired(const Ratio& ratio) const;
  template <class Find, class Unit>
  void look_at_runs(const std::vector<std::size_t>& schemes, bool takes_within, const Find& find, const Unit& unit,
                    EqualPoint& point) const;
};

}  // namespace dpde::report
