// SPDX-License-Identifier: Apache-2.0
#include "stability/wave_sum.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "dpde/phi.h"

namespace dpde::stability {

namespace {

using Complex = std::complex<double>;

constexpr double smallest_angle = 1e-9;  // of what is a wave

Complex value_at(const std::vector<NumberMonomial>& symbol, const std::array<double, 3>& angles) {
  Complex sum = 0;
  for (const NumberMonomial& monomial : symbol) {
    Complex term = monomial.coefficient;
    for (std::size_t axis = 0; axis < angles.size(); ++axis) {
      for (int k = 0; k < monomial.powers[axis]; ++k) term *= Complex(0, angles[axis]);
    }
    sum += term;
  }
  return sum;
}

/// Of the monomial that is this axis alone.
double slope_along(const std::vector<NumberMonomial>& symbol, std::size_t axis) {
  std::array<int, 3> powers{};
  powers[axis] = 1;
  double sum = 0;
  for (const NumberMonomial& monomial : symbol) sum += monomial.powers == powers ? monomial.coefficient : 0;
  return sum;
}

bool has_waves(const std::vector<NumberMonomial>& symbol) {
  return std::ranges::any_of(symbol, [](const NumberMonomial& monomial) {
    return monomial.coefficient != 0 && monomial.powers != std::array{0, 0, 0};
  });
}

}  // namespace

Complex WaveMultiplier::at(const std::array<double, 3>& angles) const {
  const auto is_short = [](double angle) { return std::abs(angle) >= 2 * std::numbers::pi / 3; };
  if (within_two_thirds && std::ranges::any_of(angles, is_short)) return 0;
  for (std::size_t axis = 0; axis < means.size(); ++axis) {
    if (means[axis] && std::abs(angles[axis]) > smallest_angle) return 0;
  }
  const Complex value = value_at(factor, angles);
  return phi < 0 ? value : dpde::phi(phi, value_at(argument, angles)) * value;
}

bool WaveMultiplier::is_constant() const {
  return means == std::array<bool, 3>{} && !within_two_thirds && !has_waves(factor) && !has_waves(argument);
}

/// phi_N' = phi_N - N*phi_P with P = N+1.
std::array<double, 3> WaveMultiplier::of_slopes() const {
  std::array<double, 3> slopes{};
  const Complex of_factor = value_at(factor, {}), of_argument = value_at(argument, {});
  for (std::size_t axis = 0; axis < slopes.size(); ++axis) {
    slopes[axis] = slope_along(factor, axis);
    if (phi < 0) continue;
    const Complex value = dpde::phi(phi, of_argument);
    const Complex change = value - static_cast<double>(phi) * dpde::phi(phi + 1, of_argument);
    slopes[axis] = (value * slopes[axis] + change * slope_along(argument, axis) * of_factor).real();
  }
  return slopes;
}

bool WaveSum::is_finite() const {
  return divisor.is_finite() && std::ranges::all_of(terms, [](const Term& term) { return term.form.is_finite(); });
}

}  // namespace dpde::stability
