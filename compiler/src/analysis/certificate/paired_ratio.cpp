// SPDX-License-Identifier: Apache-2.0
#include "analysis/certificate/paired_ratio.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace dpde::analysis {

namespace {

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// Estimated variance of the mean of the values; 0 for a single value.
double variance_of_mean(const std::vector<double>& values) {
  if (values.size() < 2) return 0;
  const double mean = mean_of(values), count = static_cast<double>(values.size());
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return squares / (count - 1) / count;
}

/// Probability that Student's t is within [-t, t]. With t = sqrt(freedom)*tan(a) this is 2C times the integral of
/// cos(a)^(freedom - 1), by Simpson's rule.
double share_within(double t, double freedom) {
  constexpr int parts = 200;
  const double width = std::atan(t / std::sqrt(freedom)) / parts;
  double sum = 0;
  for (int k = 0; k <= parts; ++k) {
    const double weight = k == 0 || k == parts ? 1 : k % 2 == 1 ? 4 : 2;
    sum += weight * std::pow(std::cos(k * width), freedom - 1);
  }
  const double log_c = std::lgamma((freedom + 1) / 2) - std::lgamma(freedom / 2) - std::log(std::numbers::pi) / 2;
  return 2 * std::exp(log_c) * sum * width / 3;
}

}  // namespace

double student_95(double freedom) {
  double low = 1.9, high = 12.8;  // 1.96 for the normal distribution, 12.71 for one degree of freedom
  while (high - low > 1e-10) {
    const double middle = (low + high) / 2;
    (share_within(middle, freedom) < 0.95 ? low : high) = middle;
  }
  return low;
}

PairedRatio paired_ratio(const std::vector<std::vector<double>>& ratios) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> of_runs, of_seeds(ratios.size());
  for (std::size_t run = 0; !ratios.empty() && run < ratios[0].size(); ++run) {
    const auto has_ratio = [&](const auto& seed) { return std::isfinite(seed[run]) && seed[run] > 0; };
    if (!std::ranges::all_of(ratios, has_ratio)) continue;
    std::vector<double> logs;
    for (const std::vector<double>& seed : ratios) logs.push_back(std::log(seed[run]));
    for (std::size_t k = 0; k < logs.size(); ++k) of_seeds[k] += logs[k];
    of_runs.push_back(mean_of(logs));
  }
  if (of_runs.empty()) return {none, none, none, 0, 0};
  for (double& sum : of_seeds) sum /= static_cast<double>(of_runs.size());
  const double mean = mean_of(of_runs), by_runs = variance_of_mean(of_runs), by_seeds = variance_of_mean(of_seeds);
  PairedRatio found{std::exp(mean), none, none, static_cast<int>(of_runs.size()), static_cast<int>(of_seeds.size())};
  if (found.runs < 2 && found.seeds < 2) return found;
  const double variance = by_runs + by_seeds;
  double parts = 0;  // denominator of Satterthwaite's formula
  if (found.runs > 1) parts += by_runs * by_runs / (found.runs - 1);
  if (found.seeds > 1) parts += by_seeds * by_seeds / (found.seeds - 1);
  const double half = variance > 0 ? student_95(variance * variance / parts) * std::sqrt(variance) : 0;
  found.low = std::exp(mean - half);
  found.high = std::exp(mean + half);
  return found;
}

}  // namespace dpde::analysis
