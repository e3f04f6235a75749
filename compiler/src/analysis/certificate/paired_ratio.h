// SPDX-License-Identifier: Apache-2.0
// Mean ratio of two numbers over runs and over trainings with different seeds.
#pragma once

#include <vector>

namespace dpde::analysis {

/// Geometric mean of ratios, and the 95 % confidence interval of the mean over all runs and seeds, if logarithms of
/// ratios are normal.
struct PairedRatio {
  double mean = 0;           // NaN if no run has a ratio
  double low = 0, high = 0;  // NaN for one run and one seed, which have no spread
  int runs = 0, seeds = 0;   // numbers of those with a ratio
  bool has_interval() const { return low <= high; }
};

/// ratios[seed][run]. A run counts only if its ratio is finite and positive for every seed, so that all seeds are
/// compared on the same runs. Runs and seeds are independent random effects of a two-way layout. The variance of the
/// mean is the sum of the variance of run means over the number of runs, and the same for seeds; degrees of freedom by
/// Satterthwaite (1946). The common part is counted twice, so the interval is rather too wide.
PairedRatio paired_ratio(const std::vector<std::vector<double>>& ratios);

/// Two-sided 95 % quantile of Student's t distribution with `freedom` >= 1 degrees of freedom.
double student_95(double freedom);

}  // namespace dpde::analysis
