// SPDX-License-Identifier: Apache-2.0
#include "analysis/certificate/taylor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace dpde::analysis {

namespace {

/// A difference is significant if it exceeds this many standard deviations of rounding.
constexpr double sure = 10;
/// Quotients agree if their spread is less than this part of their distance from the derivative.
constexpr double agreement_of_quotients = 0.1;

/// For three adjacent points: mean of the two slopes, and their difference.
struct LocalSlope {
  double mean, spread;
};

/// Slopes above `floor`, largest steps first.
std::vector<LocalSlope> local_slopes(const std::vector<Remainder>& remainders, double floor) {
  std::vector<LocalSlope> slopes;
  for (std::size_t k = 0; k + 2 < remainders.size(); ++k) {
    const Remainder &a = remainders[k], &b = remainders[k + 1], &c = remainders[k + 2];
    if (!(a.value > floor && b.value > floor && c.value > floor) || !std::isfinite(a.value + b.value + c.value))
      continue;
    const double first = std::log(a.value / b.value) / std::log(a.step / b.step);
    const double second = std::log(b.value / c.value) / std::log(b.step / c.step);
    slopes.push_back({(first + second) / 2, std::abs(first - second)});
  }
  return slopes;
}

/// Whether the quotients agree at the three smallest steps where they differ from the derivative by more than rounding.
bool agree_elsewhere(const std::vector<Quotient>& quotients, const DirectionalDerivative& derivative) {
  std::vector<double> apart;
  for (auto q = quotients.rbegin(); q != quotients.rend() && apart.size() < 3; ++q) {
    const double difference = q->value - derivative.value;
    const double noise = sure * q->rounding + derivative.rounding;
    const auto [low, high] = std::minmax(q->ahead, q->behind);
    const bool is_between = derivative.value > low - noise && derivative.value < high + noise;
    const bool is_apart = std::abs(difference) > noise && !is_between;
    if (is_apart) apart.push_back(difference);
    if (!is_apart && !apart.empty()) return false;  // larger steps converge to the derivative: no other limit
  }
  if (apart.size() < 3) return false;
  const auto [low, high] = std::ranges::minmax(apart);
  return high - low <= agreement_of_quotients * std::min(std::abs(low), std::abs(high));
}

}  // namespace

std::optional<double> remainder_slope(const std::vector<Remainder>& remainders, double floor) {
  const std::vector<LocalSlope> slopes = local_slopes(remainders, floor);
  const auto best = std::min_element(slopes.begin(), slopes.end(),
                                     [](const LocalSlope& a, const LocalSlope& b) { return a.spread < b.spread; });
  return best == slopes.end() ? std::nullopt : std::optional(best->mean);
}

std::optional<double> slope_at_small_steps(const std::vector<Remainder>& remainders, double floor) {
  constexpr double agreement = 0.02;
  const std::vector<LocalSlope> slopes = local_slopes(remainders, floor);
  const auto last =
      std::find_if(slopes.rbegin(), slopes.rend(), [](const LocalSlope& s) { return s.spread < agreement; });
  return last == slopes.rend() ? remainder_slope(remainders, floor) : std::optional(last->mean);
}

bool falls_as_squares(const std::vector<Remainder>& remainders, double floor) {
  for (std::size_t k = 0; k + 1 < remainders.size(); ++k) {
    const Remainder &larger = remainders[k], &smaller = remainders[k + 1];
    if (!(larger.value > floor)) continue;
    const double ratio = larger.step / smaller.step, expected = larger.value / (ratio * ratio);
    const double slope = std::log(larger.value / std::max(smaller.value, floor)) / std::log(ratio);
    const bool is_below = smaller.value <= floor && expected <= 2 * floor;
    if (!is_below && !(std::abs(slope - 2) <= 2 * largest_slope_error)) return false;
  }
  return true;
}

double rounding_of(const Line& f, double spacing, double unit) {
  constexpr int order = 4;
  constexpr double variances = 70;  // variance of a fourth difference over that of a value: 1 + 16 + 36 + 16 + 1
  std::array<double, 8> values{};
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = f(spacing * static_cast<double>(i));
  const double least = unit * std::abs(values[0]);
  std::size_t count = values.size();
  for (int k = 0; k < order; ++k) {
    --count;
    for (std::size_t i = 0; i < count; ++i) values[i] = values[i + 1] - values[i];
  }
  double squares = 0;
  for (std::size_t i = 0; i < count; ++i) squares += values[i] * values[i];
  return std::max(least, std::sqrt(squares / (variances * static_cast<double>(count))));
}

std::vector<Quotient> quotients_of(const Line& f, const std::vector<double>& steps, double rounding) {
  std::vector<Quotient> quotients;
  const double here = f(0);
  for (const double h : steps) {
    const double ahead = f(h), behind = f(-h);
    quotients.push_back({h, (ahead - behind) / (2 * h), (ahead - here) / h, (here - behind) / h, rounding / h});
  }
  return quotients;
}

std::optional<JumpOnLine> jump_within(const Line& f, double reach, double rounding, double closest) {
  constexpr int parts = 16, levels = 8;  // the closest points are 5e-10 of the reach apart
  JumpOnLine found{-reach, 0};
  double width = 2 * reach;
  for (int level = 0; level < levels; ++level, width /= parts) {
    std::array<double, parts> rises{};
    double last = f(found.at);
    for (std::size_t i = 0; i < parts; ++i) {
      const double next = f(found.at + width * static_cast<double>(i + 1) / parts);
      rises[i] = next - std::exchange(last, next);
    }
    std::size_t steepest = 0;
    double most = 0;
    for (std::size_t i = 0; i < parts; ++i) {
      const double before = rises[i > 0 ? i - 1 : 2], behind = rises[i + 1 < parts ? i + 1 : parts - 3];
      const double apart = std::abs(rises[i] - (before + behind) / 2);
      if (!(apart > most)) continue;
      most = apart;
      steepest = i;
    }
    if (!(most > sure * rounding)) return std::nullopt;
    const bool is_closest = width > closest && width / parts <= closest;
    const bool is_steep = level > 0 && is_closest && most >= found.size / 2;
    found = {found.at + width * static_cast<double>(steepest) / parts, most};
    if (is_steep) break;
  }
  return found;
}

std::optional<JumpOnLine> jump_beside(const Line& f, double derivative, const std::vector<double>& steps,
                                      double rounding) {
  constexpr double disagreement = 1e-3, least_share = 1e-2;  // smallest part of a remainder due to the jump
  const double here = f(0);
  std::vector<Remainder> apart;
  for (const double step : steps) {
    const double ahead = f(step) - here, behind = here - f(-step), change = step * derivative;
    const double rest = std::max(std::abs(ahead - change), std::abs(behind - change));
    const double size = std::max({std::abs(change), std::abs(ahead), std::abs(behind)});
    if (rest > disagreement * size && rest > sure * rounding) apart.push_back({step, rest});
  }
  if (apart.empty()) return std::nullopt;
  for (const Remainder& one : {apart.front(), apart.back()}) {  // few near jumps, and distant ones
    const std::optional<JumpOnLine> jump = jump_within(f, one.step, rounding, steps.back());
    if (jump && jump->size > least_share * one.value) return jump;
  }
  return std::nullopt;
}

QuotientEvidence judge(const std::vector<Quotient>& quotients, const DirectionalDerivative& derivative) {
  QuotientEvidence result;
  result.is_elsewhere = agree_elsewhere(quotients, derivative);
  for (std::size_t k = 0; k + 2 < quotients.size(); ++k) {
    double error = 0, rounding = 0;
    for (std::size_t i = k; i < k + 3; ++i) {
      const Quotient& q = quotients[i];
      const double size = std::max(std::abs(q.value), std::abs(derivative.value));
      const double own = std::abs(q.value - derivative.value), noise = sure * q.rounding + derivative.rounding;
      error = std::max(error, size > 0 ? own / size : 0);
      rounding = std::max(rounding, size > 0 ? noise / size : INFINITY);
      if (!std::isfinite(own)) error = INFINITY;
    }
    if (!std::isfinite(error) ||
        std::max(error, rounding) >= std::max(result.error.value_or(INFINITY), result.rounding))
      continue;
    result.error = error;
    result.rounding = rounding;
  }
  return result;
}

}  // namespace dpde::analysis
