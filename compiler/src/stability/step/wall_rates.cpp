// SPDX-License-Identifier: Apache-2.0
#include "stability/step/wall_rates.h"

#include <algorithm>
#include <cmath>
#include <complex>

namespace dpde::stability {

double WallRates::rate(const ScenePoint& at, double step) const {
  double largest = 0;
  for (const std::complex<double> g : all_.eigenvalues(at.point, step))
    largest = std::max(largest, std::log(std::abs(g)) / step);
  return largest;
}

double WallRates::own_rate(const ScenePoint& at, double short_step) const {
  double largest = 0;
  for (const std::complex<double> g : plain_.eigenvalues(at.point, short_step)) {
    if (std::abs(g - 1.0) < 0.5) largest = std::max(largest, std::log(std::abs(g)) / short_step);
  }
  return largest;
}

double WallRates::growth_by_events(const ScenePoint& at) const {
  double largest = 0;
  if (!has_events_) return largest;
  for (const std::complex<double> g : all_.eigenvalues(at.point, 0)) largest = std::max(largest, std::log(std::abs(g)));
  return largest;
}

}  // namespace dpde::stability
