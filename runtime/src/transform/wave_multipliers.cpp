// SPDX-License-Identifier: Apache-2.0
#include "transform/wave_multipliers.h"

#include <algorithm>
#include <cstdlib>
#include <numbers>
#include <utility>

#include "dpde/wave_functions.h"

namespace dpde {
namespace {

int64_t signed_mode(int64_t m, int64_t n) { return 2 * m <= n ? m : m - n; }

std::complex<double> value_of(const dpde_transform_term& term, std::complex<double> argument, double size) {
  if (term.function == DPDE_PHI) return phi(term.number, argument);
  return term.function == DPDE_HEAVISIDE ? heaviside(argument) : inverse(term.number, argument, size);
}

bool is_even(const dpde_monomial& monomial) {
  return (monomial.powers[0] + monomial.powers[1] + monomial.powers[2]) % 2 == 0;
}

/// Works on doubles and knows whether `to` is `from` or disjoint from it, so that the loop vectorises. Products of
/// std::complex would not, since they test for values that are not finite.
template <bool are_real, bool are_added>
void multiply_waves(const double* factors, const double* from, int64_t count, double* to) {
#pragma omp simd
  for (int64_t i = 0; i < count; ++i) {
    const double x = from[2 * i], y = from[2 * i + 1];
    const double a = factors[are_real ? i : 2 * i], b = are_real ? 0 : factors[2 * i + 1];
    const double real = are_real ? a * x : a * x - b * y, imaginary = are_real ? a * y : a * y + b * x;
    to[2 * i] = are_added ? to[2 * i] + real : real;
    to[2 * i + 1] = are_added ? to[2 * i + 1] + imaginary : imaginary;
  }
}

}  // namespace

std::array<int64_t, 3> WaveLines::mode(int64_t line, int64_t place) const {
  std::array<int64_t, 3> mode{};
  const std::size_t near = along == 0 ? 1 : 0, far = along == 2 ? 1 : 2;
  mode[along] = place;
  mode[near] = line % modes[near];
  mode[far] = line / modes[near];
  return mode;
}

WaveMultipliers::WaveMultipliers(const WaveLines& lines, std::vector<const dpde_transform_term*> terms)
    : lines_(lines), terms_(std::move(terms)) {
  for (const dpde_transform_term* term : terms_) {
    note(term->argument);
    note(term->factor);
  }
  values_.assign(uniforms_.size(), 0.0);
  multipliers_ = AlignedValues(lines_.count() * lines_.length() * (are_real_ ? 1 : 2));
}

void WaveMultipliers::note(const dpde_symbol& symbol) {
  for (int32_t i = 0; i < symbol.count; ++i) {
    const dpde_monomial& monomial = symbol.monomials[i];
    are_real_ = are_real_ && is_even(monomial);
    if (monomial.uniform >= 0 && !std::ranges::count(uniforms_, monomial.uniform))
      uniforms_.push_back(monomial.uniform);
  }
}

/// True also on the first call.
bool WaveMultipliers::have_changed(const double* uniforms) {
  bool changed = !std::exchange(are_made_, true);
  for (std::size_t i = 0; i < uniforms_.size(); ++i) {
    const double value = uniforms[uniforms_[i]];
    changed = changed || values_[i] != value;
    values_[i] = value;
  }
  return changed;
}

void WaveMultipliers::update(const double* uniforms, const Team& team) {
  if (!have_changed(uniforms)) return;
  double cells = 1;  // forward and backward transforms together multiply by the number of cells
  for (std::size_t axis = 0; axis < 3; ++axis) cells *= lines_.axes[axis] ? static_cast<double>(lines_.cells[axis]) : 1;
  team.run(lines_.count(), [&](int64_t line, int) {
    double* to = multipliers_.get() + line * lines_.length() * (are_real_ ? 1 : 2);
    for (int64_t i = 0; i < lines_.length(); ++i) {
      const Complex multiplier = at(lines_.mode(line, i), uniforms) / cells;
      *to++ = multiplier.real();
      if (!are_real_) *to++ = multiplier.imag();
    }
  });
}

WaveMultipliers::Symbol WaveMultipliers::value(const dpde_symbol& symbol, const std::array<double, 3>& angles,
                                               const double* uniforms) {
  Symbol result;
  for (int32_t i = 0; i < symbol.count; ++i) {
    const dpde_monomial& monomial = symbol.monomials[i];
    Complex term = monomial.uniform == DPDE_ZERO ? 0 : monomial.uniform == DPDE_ONE ? 1 : uniforms[monomial.uniform];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int32_t power = monomial.powers[axis];
      if (power >= vanishing_power && std::abs(angles[axis]) == std::numbers::pi) term = 0;
      for (int32_t k = 0; k < power % vanishing_power; ++k) term *= Complex(0, angles[axis]);
    }
    result.sum += term;
    result.size += std::abs(term);
  }
  return result;
}

/// Mean over both signs of the angles of modes of wavelength 2 cells, along `axis` and later axes.
WaveMultipliers::Complex WaveMultipliers::mean_at(std::array<double, 3> angles, std::size_t axis, bool is_short,
                                                  const double* uniforms) const {
  for (; axis < 3; ++axis) {
    if (angles[axis] != std::numbers::pi) continue;
    const Complex positive = mean_at(angles, axis + 1, is_short, uniforms);
    angles[axis] = -angles[axis];
    return (positive + mean_at(angles, axis + 1, is_short, uniforms)) / 2.0;
  }
  Complex sum = 0;
  for (const dpde_transform_term* term : terms_) {
    if (is_short && term->within_two_thirds != 0) continue;
    const Complex factor = value(term->factor, angles, uniforms).sum;
    if (term->function == DPDE_NO_FUNCTION) {
      sum += factor;
      continue;
    }
    const Symbol argument = value(term->argument, angles, uniforms);
    sum += factor * value_of(*term, argument.sum, argument.size);
  }
  return sum;
}

WaveMultipliers::Complex WaveMultipliers::at(const std::array<int64_t, 3>& mode, const double* uniforms) const {
  bool is_short = false;
  std::array<double, 3> angles{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!lines_.axes[axis]) continue;
    const int64_t n = lines_.cells[axis], m = signed_mode(mode[axis], n);
    is_short = is_short || (m != 0 && 3 * std::abs(m) >= n);
    angles[axis] =
        2 * m == n ? std::numbers::pi : 2 * std::numbers::pi * static_cast<double>(m) / static_cast<double>(n);
  }
  return mean_at(angles, 0, is_short, uniforms);
}

void WaveMultipliers::multiply(int64_t line, int64_t lines, const Complex* waves, Complex* product,
                               bool is_added) const {
  const int64_t first = line * lines_.length(), count = lines * lines_.length();
  const double* const factors = multipliers_.get() + first * (are_real_ ? 1 : 2);
  const auto* const from = reinterpret_cast<const double*>(waves);
  auto* const to = reinterpret_cast<double*>(product);
  if (are_real_) return (is_added ? multiply_waves<true, true> : multiply_waves<true, false>)(factors, from, count, to);
  (is_added ? multiply_waves<false, true> : multiply_waves<false, false>)(factors, from, count, to);
}

}  // namespace dpde
