// SPDX-License-Identifier: Apache-2.0
// Polynomials of i times the wave numbers, as they stand in the multipliers of transforms: what a sum of derivatives
// with constant coefficients does to a wave exp(i k.x).
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

constexpr int highest_function = 19;  // of phiN, inverseN in a text: derivatives, which go up by one, are written again
constexpr int highest_power = 16;     // of i times a wave number along one axis

/// i times the wave number along an axis.
Expr wave_number(int axis);
/// The same, and 0 for a wave of two cells along the axis.
Expr slope_number(int axis);
/// The axis of either; nullopt for everything else.
std::optional<int> wave_axis(const Expr& e);
bool is_slope_number(const Expr& e);
bool holds_wave_number(const Expr& e);
/// Params that are none.
bool holds_params(const Expr& e);

/// coefficient * ikx^powers[0] * iky^powers[1] * ikz^powers[2]; one factor is ikx0 in the place of ikx where it
/// vanishes for waves of two cells along x.
struct Monomial {
  Expr coefficient;
  std::array<int, max_rank> powers{};
  std::array<bool, max_rank> vanishes{};
};
/// Each combination of powers once, in the order in which they are met. nullopt: no polynomial, or of too high a power.
std::optional<std::vector<Monomial>> polynomial_of(const Expr& e);
/// The polynomial as an expression: sums of products.
Expr expression_of(const std::vector<Monomial>& polynomial);

/// The symbol as sums of derivatives have it at the centres of cells: terms of odd order along an axis are 0 for waves
/// of two cells along it. Functions and products of such symbols are those of what the derivatives do; of others the
/// mean over k and -k is not, and damps waves of two cells that derivatives leave alone.
Expr with_slopes(const Expr& symbol);
/// Whether such terms are in it.
bool holds_odd_powers(const Expr& symbol);
/// The multiplier of the transposed operator: of k in place of -k.
Multiplier transposed(Multiplier multiplier);
/// Calls `f` on argument and factor; the argument counts only where there is a function.
void for_each_symbol(const Transform& transform, const std::function<void(const Expr&)>& f);
/// Its parameters but for the wave numbers, in order of first appearance.
std::vector<std::string> params_of(const Transform& transform);
/// Along which axes it has wave numbers.
std::array<bool, max_rank> axes_of(const Expr& symbol);
/// Along all of them where it cuts waves.
std::array<bool, max_rank> axes_of(const Transform& transform, std::size_t rank);

}  // namespace dpde::stencil
