// SPDX-License-Identifier: Apache-2.0
#include "solve/fourier.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "solve/finite.h"
#include "solve/vector_parts.h"

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

/// What the operator multiplies a wave by.
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

/// Makes the solver take the wave out of right sides.
void FourierSolver::drop(std::size_t number) {
  if (dropped_.empty()) {
    dropped_.assign(inverse_symbol_.size(), 0.0);
    taken_.assign(static_cast<std::size_t>(rows_.size()), 0.0);
  }
  dropped_[have_phases_ ? 2 * number : number] = 1 / waves_.scale();
}

FourierSolver::FourierSolver(const ConstantRows& rows, bool is_singular, const Team& team)
    : rows_(rows), team_(team), waves_(rows_.cells(), rows_.sides(), team) {
  const double size = rows_.row_size();
  const double zero = 64 * 0x1p-52 * size;  // rows of singular operators are balanced: what is less is of this sum
  have_phases_ = waves_.are_complex() && !rows_.is_even(rows_.periodic(), 4 * 0x1p-52 * size);
  inverse_symbol_.assign(static_cast<std::size_t>(waves_.size() * (have_phases_ ? 2 : 1)), 0.0);
  const Turns factors = all_turns();
  waves_.for_each([&](std::size_t number, const std::array<std::int64_t, 3>& turns) {
    if (is_singular && turns == std::array<std::int64_t, 3>{}) return;  // the mean
    Complex symbol = symbol_of(turns, factors);
    if (!have_phases_) symbol = symbol.real();
    if (std::abs(symbol) <= zero) return drop(number);
    const Complex inverse = 1.0 / (symbol * waves_.scale());
    inverse_symbol_[have_phases_ ? 2 * number : number] = inverse.real();
    if (have_phases_) inverse_symbol_[2 * number + 1] = inverse.imag();
  });
}

bool FourierSolver::has_walls() const {
  return std::ranges::any_of(rows_.sides(), [](Sides sides) { return sides != Sides::periodic; });
}

/// Takes the waves that the operator makes 0 of out of b.
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
