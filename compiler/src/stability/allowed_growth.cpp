// SPDX-License-Identifier: Apache-2.0
#include "stability/allowed_growth.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

namespace dpde::stability {

namespace {

constexpr double nearly = 0.1;  // of the largest growth rate

}  // namespace

bool is_resolved(const Angles& a) {
  return std::ranges::all_of(a, [](double angle) {
    return std::abs(std::remainder(angle, 2 * std::numbers::pi)) <= std::numbers::pi / 4 + 1e-9;
  });
}

/// A wave may grow twice as fast as in the equations, as a scheme may err in physical growth. Resolved waves, and those
/// of Fourier series that do not decay, may grow at least at the largest rate of all waves: errors that grow no faster
/// than the solution do no harm. Other waves that do not surely decay may grow at a fifth of the largest rate.
double AllowedGrowth::rate_of(const Angles& wave, double own) const {
  if (growth == 0) return 0;
  const double by_right = 2 * std::clamp(own, 0.0, growth);
  const bool decays = own < -slowest_decay();
  if (is_resolved(wave) || (are_all_resolved && !decays)) return std::max(by_right, growth);
  return decays ? 0 : std::max(by_right, 2 * slowest_decay());
}

double AllowedGrowth::slowest_decay() const { return nearly * growth; }

double growth_behind(std::size_t others, const Eigen::VectorXcd& factors) {
  std::vector<double> sizes;
  for (const std::complex<double> factor : factors) sizes.push_back(std::abs(factor));
  std::ranges::sort(sizes, std::greater());
  return others < sizes.size() ? std::log(sizes[others]) : -std::numeric_limits<double>::infinity();
}

}  // namespace dpde::stability
