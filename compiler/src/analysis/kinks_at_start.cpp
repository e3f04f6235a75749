// SPDX-License-Identifier: Apache-2.0
#include "analysis/kinks_at_start.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "analysis/certificate/taylor.h"

namespace dpde::analysis {

namespace {

/// Finds the one-sided slopes at the three smallest steps with rounding below a hundredth of their difference. Returns
/// false if the difference shrinks with the step, as for smooth functions.
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

std::vector<KinkAtStart> kinks_at_start(driver::Inverse& inverse, std::mt19937_64& random) {
  const Eigen::VectorXd start = inverse.start();
  Eigen::VectorXd gradient(inverse.size()), all(inverse.size());
  if (!std::isfinite(inverse.value_and_gradient(start, gradient))) return {};
  inverse.hold_steps(true);
  std::uniform_real_distribution<double> part_of_one(0.5, 1.5);
  for (double& one : all) one = part_of_one(random);
  for (const driver::Inverse::Part& part : inverse.parts()) {
    if (part.size == 1) all[part.offset] = 1;  // for a number: slopes with respect to it
  }
  std::vector<double> steps;
  for (int k = 0; k < 12; ++k) steps.push_back(1e-2 * std::exp2(-2 * k));
  const auto look = [&](const Eigen::VectorXd& direction) -> std::optional<Quotient> {
    const Line along = [&](double step) { return inverse.value(start + step * direction); };
    Quotient at{};
    const bool found = has_kink(quotients_of(along, steps, rounding_of(along, 1e-8, 0x1p-52)), at);
    return found ? std::optional(at) : std::nullopt;
  };
  std::vector<KinkAtStart> found;
  const bool has_any = look(all).has_value();
  for (const driver::Inverse::Part& part : inverse.parts()) {
    if (!has_any) break;
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(inverse.size());
    direction.segment(part.offset, part.size) = all.segment(part.offset, part.size);
    const std::optional<Quotient> at = look(direction);
    if (at) found.push_back({part.name, at->ahead, at->behind, gradient.dot(direction), part.size > 1});
  }
  inverse.hold_steps(false);
  return found;
}

bool is_finite_at_start(driver::Inverse& inverse) {
  Eigen::VectorXd gradient(inverse.size());
  return std::isfinite(inverse.value_and_gradient(inverse.start(), gradient)) && gradient.allFinite();
}

std::string jump_at_start(driver::Session& session, driver::Inverse& inverse) {
  inverse.assign(inverse.start());
  const std::optional<Unsolved> jump = session.engine().jump_in_run();
  return jump ? jump->what() : "";
}

}  // namespace dpde::analysis
