// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/wave_sum.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "dpde/wave_functions.h"
#include "support/assert.h"

namespace dpde::stability {

namespace {

using Complex = std::complex<double>;

constexpr double smallest_angle = 1e-9;  // of a wave; smaller angles are the mean

/// A sum, and the sum of the magnitudes of its terms.
struct Sum {
  Complex value = 0;
  double size = 0;
};

Sum value_at(const std::vector<NumberMonomial>& symbol, const std::array<double, 3>& angles) {
  Sum sum;
  for (const NumberMonomial& monomial : symbol) {
    double term = monomial.coefficient;  // times a power of i
    int quarters = 0;
    for (std::size_t axis = 0; axis < angles.size(); ++axis) {
      for (int k = 0; k < monomial.powers[axis]; ++k) term *= angles[axis];
      quarters += monomial.powers[axis];
      // The wave of two cells has no slope at their centres.
      const bool vanishes = monomial.powers[axis] % 2 != 0 || monomial.vanishes[axis];
      if (vanishes && std::abs(std::abs(angles[axis]) - std::numbers::pi) < 1e-12) term = 0;
    }
    const double turned = quarters % 4 < 2 ? term : -term;
    sum.value += quarters % 2 == 0 ? Complex(turned, 0) : Complex(0, turned);
    sum.size += std::abs(term);
  }
  return sum;
}

Complex value_of(const WaveFunction& function, const Sum& argument) {
  switch (function.kind) {
    case WaveFunction::Kind::none: return 1;
    case WaveFunction::Kind::phi: return phi(function.number, argument.value);
    case WaveFunction::Kind::inverse: return inverse(function.number, argument.value, argument.size);
    case WaveFunction::Kind::heaviside: return heaviside(argument.value);
  }
  unreachable("wave function");
}

/// The derivative by the argument: phi_N' = phi_N - N*phi_P, inverse_N' = -N*inverse_P, with P = N+1; heaviside' = 0.
Complex slope_of(const WaveFunction& function, const Sum& argument) {
  const auto [kind, number] = function;
  const Complex next = static_cast<double>(number) * value_of({kind, number + 1}, argument);
  return kind == WaveFunction::Kind::phi ? value_of(function, argument) - next : -next;
}

/// The coefficient of the first power of this axis alone.
double slope_along(const std::vector<NumberMonomial>& symbol, std::size_t axis) {
  std::array<int, 3> powers{};
  powers[axis] = 1;
  double sum = 0;
  for (const NumberMonomial& monomial : symbol) sum += monomial.powers == powers ? monomial.coefficient : 0;
  return sum;
}

/// The derivative by i*angle, of known monomials: not of 1/dt with dt = 0. A slope that vanishes for waves of two cells
/// has derivative 1 next to them on both sides.
std::vector<NumberMonomial> derivative_of(const std::vector<NumberMonomial>& symbol, std::size_t axis) {
  std::vector<NumberMonomial> result;
  for (NumberMonomial monomial : symbol) {
    const bool varies = monomial.coefficient != 0 && std::isfinite(monomial.coefficient) && monomial.powers[axis] > 0;
    if (!varies) continue;
    monomial.coefficient *= monomial.powers[axis]--;
    monomial.vanishes[axis] = monomial.vanishes[axis] && monomial.powers[axis] > 0;
    result.push_back(monomial);
  }
  return result;
}

std::vector<NumberMonomial> product_of_symbols(const std::vector<NumberMonomial>& a,
                                               const std::vector<NumberMonomial>& b, double factor) {
  std::vector<NumberMonomial> result;
  for (const NumberMonomial& left : a) {
    for (NumberMonomial product : b) {
      product.coefficient *= factor * left.coefficient;
      for (std::size_t axis = 0; axis < product.powers.size(); ++axis) {
        product.powers[axis] += left.powers[axis];
        product.vanishes[axis] = product.vanishes[axis] || left.vanishes[axis] || left.powers[axis] % 2 != 0;
      }
      result.push_back(product);
    }
  }
  return result;
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
  return value_of(function, value_at(argument, angles)) * value_at(factor, angles).value;
}

bool WaveMultiplier::is_constant() const {
  return means == std::array<bool, 3>{} && !within_two_thirds && !has_waves(factor) && !has_waves(argument);
}

bool WaveMultiplier::is_zero() const {
  const auto is_number = [](const NumberMonomial& monomial) { return std::isfinite(monomial.coefficient); };
  const auto is_part = [](const NumberMonomial& monomial) { return monomial.coefficient != 0; };
  return std::ranges::none_of(factor, is_part) || !std::ranges::all_of(factor, is_number) ||
         !std::ranges::all_of(argument, is_number);
}

bool WaveMultiplier::solves() const { return function.kind == WaveFunction::Kind::inverse && has_waves(argument); }

/// The solution is not known if the operator takes constants to 0: it then depends on the right-hand side elsewhere.
double WaveMultiplier::of_constant() const {
  const bool is_open = function.kind == WaveFunction::Kind::inverse && value_at(argument, {}).size == 0;
  return is_open ? std::numeric_limits<double>::infinity() : at({}).real();
}

std::array<double, 3> WaveMultiplier::of_slopes() const {
  std::array<double, 3> slopes{};
  const Sum of_factor = value_at(factor, {}), of_argument = value_at(argument, {});
  for (std::size_t axis = 0; axis < slopes.size(); ++axis) {
    slopes[axis] = slope_along(factor, axis);
    if (!function) continue;
    const Complex of_slope = slope_of(function, of_argument) * slope_along(argument, axis) * of_factor.value;
    slopes[axis] = (value_of(function, of_argument) * slopes[axis] + of_slope).real();
  }
  return slopes;
}

std::vector<WaveMultiplier> WaveMultiplier::derivatives(std::size_t axis,
                                                        const std::vector<NumberMonomial>& of_argument) const {
  std::vector<WaveMultiplier> result;
  const auto add = [&](const WaveFunction& f, std::vector<NumberMonomial> by) {
    if (!by.empty()) result.push_back({f, argument, std::move(by), within_two_thirds, means});
  };
  add(function, derivative_of(factor, axis));
  if (!function) return result;
  const std::vector<NumberMonomial> inner = derivative_of(of_argument, axis);
  const auto [kind, number] = function;
  if (kind == WaveFunction::Kind::phi) add(function, product_of_symbols(inner, factor, 1));
  add({kind, number + 1}, product_of_symbols(inner, factor, -static_cast<double>(number)));
  return result;
}

bool WaveSum::is_finite() const {
  return divisor.is_finite() && std::ranges::all_of(terms, [](const Term& term) { return term.form.is_finite(); });
}

}  // namespace dpde::stability
