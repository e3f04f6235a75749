// SPDX-License-Identifier: Apache-2.0
// How many times one number is another, over runs and over trainings that differ in their seeds.
#pragma once

#include <vector>

namespace dpde::analysis {

/// The geometric mean of ratios, and the interval that holds the mean over all runs and seeds in 95 of 100 cases, as
/// far as logarithms of ratios are normal.
struct PairedRatio {
  double mean = 0;           // not a number where no run has a ratio
  double low = 0, high = 0;  // not numbers where one run and one seed tell no spread
  int runs = 0, seeds = 0;   // with a ratio
  bool has_interval() const { return low <= high; }
};

/// ratios[seed][run]. A run whose ratio is not finite and positive for every seed counts for none, so that all seeds
/// are judged by the same runs. Runs and seeds are drawn independently of one another (a two-way layout with random
/// effects): the variance of the mean is that of the means of runs over their number, and the same of seeds, with the
/// degrees of freedom of Satterthwaite (1946). What both share is counted twice, so that the interval is none too
/// narrow.
PairedRatio paired_ratio(const std::vector<std::vector<double>>& ratios);

/// The t that Student's distribution with `freedom` >= 1 degrees exceeds, to both sides together, in 5 of 100 cases.
double student_95(double freedom);

}  // namespace dpde::analysis
