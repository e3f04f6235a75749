// SPDX-License-Identifier: Apache-2.0
#include "driver/kinks_at_start.h"

#include <algorithm>
#include <cmath>

#include "driver/taylor.h"

namespace dpde::driver {

namespace {

/// The slopes at the three smallest steps at which rounding is below a hundredth of their difference; false where the
/// difference shrinks with the step, as it does of what is smooth.
bool has_kink(const std::vector<Quotient>& quotients, Quotient& at) {
  std::vector<double> jumps;
  for (auto q = quotients.rbegin(); q != quotients.rend() && jumps.size() < 3; ++q) {
    const double jump = q->ahead - q->behind, size = std::max(std::abs(q->ahead), std::abs(q->behind));
    if (!std::isfinite(jump) || std::abs(jump) <= std::max(100 * q->rounding, 1e-6 * size)) continue;
    if (jumps.empty()) at = *q;
    jumps.push_back(jump);
  }
  if (jumps.size() < 3) return false;
  const auto [low, high] = std::ranges::minmax(jumps);
  return low * high > 0 && high - low <= 0.1 * std::max(std::abs(low), std::abs(high));
}

}  // namespace

std::vector<KinkAtStart> kinks_at_start(Inverse& inverse, std::mt19937_64& random) {
  const Eigen::VectorXd start = inverse.start();
  Eigen::VectorXd gradient(inverse.size());
  if (!std::isfinite(inverse.value_and_gradient(start, gradient))) return {};
  std::vector<double> steps;
  for (int k = 0; k < 12; ++k) steps.push_back(1e-2 * std::exp2(-2 * k));
  std::uniform_real_distribution<double> part_of_one(0.5, 1.5);
  std::vector<KinkAtStart> found;
  for (const Inverse::Part& part : inverse.parts()) {
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(inverse.size());
    for (std::ptrdiff_t i = 0; i < part.size; ++i) direction[part.offset + i] = part_of_one(random);
    const Line along = [&](double step) { return inverse.value(start + step * direction); };
    Quotient at{};
    if (!has_kink(quotients_of(along, steps, rounding_of(along, 1e-8, 0x1p-52)), at)) continue;
    found.push_back({part.name, at.ahead, at.behind, gradient.dot(direction)});
  }
  return found;
}

}  // namespace dpde::driver
