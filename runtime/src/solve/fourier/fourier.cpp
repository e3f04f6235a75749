// SPDX-License-Identifier: Apache-2.0
#include "solve/fourier/fourier.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <utility>

#include "solve/operator/finite.h"
#include "solve/operator/vector_parts.h"

namespace dpde {

std::optional<FourierSolver> FourierSolver::of(const StencilMatrix& matrix, double rounding, bool is_singular,
                                               const Team& team) {
  const std::optional<ConstantRows> rows = ConstantRows::of(matrix, rounding);
  if (!rows) return std::nullopt;
  return FourierSolver(*rows, is_singular, team);
}

FourierSolver::Turns FourierSolver::all_turns() const {
  Turns result;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t period = waves_.period(axis);
    for (std::int64_t j = 0; j < period; ++j) {
      const Complex turn = std::polar(1.0, 2 * std::numbers::pi * static_cast<double>(j) / static_cast<double>(period));
      result[axis].push_back(rows_.sides()[axis] == Sides::periodic ? turn : turn.real());
    }
  }
  return result;
}

/// The operator's multiplier of a Fourier mode.
FourierSolver::Complex FourierSolver::symbol_of(const std::array<std::int64_t, 3>& turns, const Turns& factors) const {
  Complex symbol = 0;
  for (std::size_t k = 0; k < rows_.row().size(); ++k) {
    Complex product = rows_.row()[k];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t offset = rows_.offsets()[k][axis];
      if (offset == 0) continue;
      const std::int64_t period = waves_.period(axis), steps = turns[axis] * offset % period;
      product *= factors[axis][static_cast<std::size_t>(steps < 0 ? steps + period : steps)];
    }
    symbol += product;
  }
  return symbol;
}

/// Marks the mode as one that the solver removes from right sides.
void FourierSolver::drop(std::size_t number) {
  if (dropped_.empty()) {
    dropped_.assign(inverse_symbol_.size(), 0.0);
    taken_.assign(static_cast<std::size_t>(rows_.size()), 0.0);
  }
  dropped_[have_phases_ ? 2 * number : number] = 1 / waves_.scale();
}

FourierSolver::FourierSolver(const ConstantRows& rows, bool is_singular, const Team& team)
    : rows_(rows), team_(team), waves_(rows_.cells(), rows_.sides(), team), is_singular_(is_singular) {
  have_phases_ = waves_.are_complex() && !rows_.is_even(rows_.periodic(), 4 * 0x1p-52 * rows_.row_size());
  find_inverse(waves_, inverse_symbol_);
}

/// The rounding error of a fast transform of n numbers is at most log2(n) times that of its values (W. M. Gentleman, G.
/// Sande, AFIPS Conf. Proc. 29, 1966, 563), which the stored x has anyway. Tested with a right side that contains all
/// modes and is the same for every operator, so that the decision does not depend on the first solve of a run.
void FourierSolver::try_floats(const GridOperator& a) {
  if (drops_waves()) return;
  const auto size = static_cast<std::size_t>(rows_.size());
  std::vector<float> right(size);
  std::minstd_rand random;
  for (float& value : right) value = static_cast<float>(random() % 1024) - 511.5F;
  std::vector<double> stored(right.begin(), right.end()), x(size);
  a.null_space().remove(stored, team_);
  divide(stored, x);
  std::vector<float> made(x.begin(), x.end());
  const auto residual = [&] {
    std::ranges::copy(made, x.begin());
    return a.residual(stored, x, team_);
  };
  const double by_rounding = residual();
  floats_.emplace(rows_.cells(), rows_.sides(), team_);
  find_inverse(*floats_, inverse_of_floats_);
  const auto read = [&](std::int64_t first, std::span<float> values) {
    std::copy_n(right.begin() + first, values.size(), values.begin());
  };
  const auto write = [&](std::int64_t first, std::span<const float> values) {
    std::ranges::copy(values, made.begin() + first);
  };
  const auto passed = divide_rows(ReadRowsOf<float>(std::ref(read)), WriteRowsOf<float>(std::ref(write)));
  const double most = (1 + std::log2(static_cast<double>(size))) * by_rounding;
  if (!passed || !passed->is_finite || !(residual() <= most)) floats_.reset();
}

template <class Real>
void FourierSolver::find_inverse(const GridWavesOf<Real>& waves, std::vector<Real>& inverse_symbol) {
  const double zero = 64 * 0x1p-52 * rows_.row_size();  // smaller values are rounding of this sum, except for the mean
  inverse_symbol.assign(static_cast<std::size_t>(waves.size() * (have_phases_ ? 2 : 1)), Real(0));
  const Turns factors = all_turns();
  waves.for_each([&](std::size_t number, const std::array<std::int64_t, 3>& turns) {
    const bool is_mean = turns == std::array<std::int64_t, 3>{};
    if (is_singular_ && is_mean) return;
    Complex symbol = is_mean ? rows_.sum() : symbol_of(turns, factors);
    if (!have_phases_) symbol = symbol.real();
    if (std::abs(symbol) <= (is_mean ? 0 : zero)) return drop(number);
    const Complex inverse = 1.0 / (symbol * waves.scale());
    inverse_symbol[have_phases_ ? 2 * number : number] = static_cast<Real>(inverse.real());
    if (have_phases_) inverse_symbol[2 * number + 1] = static_cast<Real>(inverse.imag());
  });
}

bool FourierSolver::has_walls() const {
  return std::ranges::any_of(rows_.sides(), [](Sides sides) { return sides != Sides::periodic; });
}

/// Removes modes in the null space of the operator from b.
double FourierSolver::drop_waves(std::span<double> b) {
  waves_.multiply(b, dropped_.data(), have_phases_, taken_);
  const double whole = sums_of(b, team_).squares, dropped = sums_of(taken_, team_).squares;
  set_each(
      team_, b, [](double value, double taken) { return value - taken; }, b, taken_);
  return whole == 0 ? 0 : std::sqrt(dropped / whole);
}

double FourierSolver::solve(std::span<double> b, std::span<double> x) {
  const double dropped = dropped_.empty() ? 0 : drop_waves(b);
  divide(b, x);
  return dropped;
}

void FourierSolver::divide(std::span<const double> b, std::span<double> x) {
  waves_.multiply(b, inverse_symbol_.data(), have_phases_, x);
}

}  // namespace dpde
