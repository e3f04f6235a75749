// SPDX-License-Identifier: Apache-2.0
#include "analysis/certificate/comparison.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace dpde::analysis {

namespace {

bool is_usable(const CostAndError& scheme) {
  return std::isfinite(scheme.cost) && std::isfinite(scheme.error) && scheme.cost > 0 && scheme.error > 0;
}

/// Log-log interpolation: y at x on the line through two points.
double between(double x, double x0, double y0, double x1, double y1) {
  if (x0 == x1) return y0;
  const double share = std::log(x / x0) / std::log(x1 / x0);
  return y0 * std::exp(share * std::log(y1 / y0));
}

}  // namespace

std::vector<CostAndError> best_of(std::vector<CostAndError> schemes) {
  std::erase_if(schemes, [](const CostAndError& scheme) { return !is_usable(scheme); });
  std::ranges::sort(schemes, {}, [](const CostAndError& scheme) { return std::tie(scheme.cost, scheme.error); });
  std::vector<CostAndError> best;
  for (CostAndError& scheme : schemes) {
    if (best.empty() || scheme.error < best.back().error) best.push_back(std::move(scheme));
  }
  return best;
}

Equal cost_of_equal_error(const std::vector<CostAndError>& schemes, double error) {
  const std::vector<CostAndError> best = best_of(schemes);
  if (best.empty() || !(error >= best.back().error)) return {Equal::Kind::beyond_all, 0, "", ""};
  if (error > best.front().error)
    return {Equal::Kind::within_all, best.front().cost, best.front().scene, best.front().scene};
  std::size_t k = 0;
  while (k + 2 < best.size() && error < best[k + 1].error) ++k;
  const CostAndError &left = best[k], &right = best[std::min(k + 1, best.size() - 1)];
  return {Equal::Kind::found, between(error, left.error, left.cost, right.error, right.cost), left.scene, right.scene};
}

Equal error_of_equal_cost(const std::vector<CostAndError>& schemes, double cost) {
  const std::vector<CostAndError> best = best_of(schemes);
  if (best.empty() || !(cost >= best.front().cost)) return {Equal::Kind::beyond_all, 0, "", ""};
  if (cost > best.back().cost)
    return {Equal::Kind::within_all, best.back().error, best.back().scene, best.back().scene};
  std::size_t k = 0;
  while (k + 2 < best.size() && cost > best[k + 1].cost) ++k;
  const CostAndError &left = best[k], &right = best[std::min(k + 1, best.size() - 1)];
  return {Equal::Kind::found, between(cost, left.cost, left.error, right.cost, right.error), left.scene, right.scene};
}

BreakEven break_even(const Equal& equal_error, double cost, double length, double spent) {
  if (equal_error.kind == Equal::Kind::beyond_all) return {BreakEven::Kind::unknown, 0};
  if (!(equal_error.value > cost)) return {BreakEven::Kind::never, 0};
  return {BreakEven::Kind::after, spent / (length * (equal_error.value - cost))};
}

}  // namespace dpde::analysis
