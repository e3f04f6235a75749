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
  std::optional<ConstantRows> rows = ConstantRows::of(matrix, rounding);
  if (!rows) return std::nullopt;
  return FourierSolver(std::move(*rows), is_singular, team);
}

/// What the operator multiplies a wave by.
FourierSolver::Complex FourierSolver::symbol_of(const std::array<std::int64_t, 3>& turns) const {
  Complex symbol = 0;
  for (std::size_t k = 0; k < rows_.row().size(); ++k) {
    double angle = 0, cosines = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t period = waves_.period(axis), steps = turns[axis] * rows_.offsets()[k][axis] % period;
      const double turn = 2 * std::numbers::pi * static_cast<double>(steps) / static_cast<double>(period);
      if (rows_.sides()[axis] == Sides::periodic) {
        angle += turn;
      } else {
        cosines *= std::cos(turn);
      }
    }
    symbol += rows_.row()[k] * cosines * std::polar(1.0, angle);
  }
  return symbol;
}

FourierSolver::FourierSolver(ConstantRows rows, bool is_singular, const Team& team)
    : rows_(std::move(rows)), team_(team), waves_(rows_.cells(), rows_.sides(), team) {
  double size = 0;
  for (const double value : rows_.row()) size += std::abs(value);
  const double zero = 64 * 0x1p-52 * size;  // rows of singular operators are balanced: what is less is of this sum
  std::array<bool, 3> rings{};
  for (std::size_t axis = 0; axis < 3; ++axis) rings[axis] = rows_.sides()[axis] == Sides::periodic;
  have_phases_ = waves_.are_complex() && !rows_.is_even(rings, 4 * 0x1p-52 * size);
  inverse_symbol_.assign(static_cast<std::size_t>(waves_.size() * (have_phases_ ? 2 : 1)), 0.0);
  std::vector<double> dropped(inverse_symbol_.size(), 0.0);
  bool drops_some = false;
  const auto set = [&](std::vector<double>& factors, std::size_t number, Complex value) {
    factors[have_phases_ ? 2 * number : number] = value.real();
    if (have_phases_) factors[2 * number + 1] = value.imag();
  };
  waves_.for_each([&](std::size_t number, const std::array<std::int64_t, 3>& turns) {
    Complex symbol = symbol_of(turns);
    if (!have_phases_) symbol = symbol.real();
    const bool is_mean = is_singular && turns == std::array<std::int64_t, 3>{};
    if (std::abs(symbol) > zero && !is_mean) {
      set(inverse_symbol_, number, 1.0 / (symbol * waves_.scale()));
    } else if (!is_mean) {
      set(dropped, number, 1 / waves_.scale());
      drops_some = true;
    }
  });
  if (!drops_some) return;
  dropped_ = std::move(dropped);
  taken_.assign(static_cast<std::size_t>(rows_.cells()[0] * rows_.cells()[1] * rows_.cells()[2]), 0.0);
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
