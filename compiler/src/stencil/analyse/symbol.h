// SPDX-License-Identifier: Apache-2.0
// Polynomials of i times the wave numbers, as used in multipliers of transforms: the factors by which a sum of
// derivatives with constant coefficients multiplies a wave exp(i k.x).
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

constexpr int highest_function = 19;  // N of phiN, inverseN in a text; derivatives, also written as text, raise N by 1
constexpr int highest_power = 16;     // power of i times a wave number along one axis

/// i times the wave number along an axis.
Expr wave_number(int axis);
/// The same, but 0 for a wave of two cells along the axis.
Expr slope_number(int axis);
/// The axis of a wave number or slope number; nullopt for other expressions.
std::optional<int> wave_axis(const Expr& e);
bool is_slope_number(const Expr& e);
bool holds_wave_number(const Expr& e);
/// Whether `e` has params other than wave numbers.
bool holds_params(const Expr& e);

/// coefficient * ikx^powers[0] * iky^powers[1] * ikz^powers[2]. If vanishes[0], one factor ikx is ikx0, so that the
/// product vanishes for waves of two cells along x; likewise y and z.
struct Monomial {
  Expr coefficient;
  std::array<int, max_rank> powers{};
  std::array<bool, max_rank> vanishes{};
};
/// Monomials with distinct powers, in order of appearance. nullopt: not a polynomial, or too high a power.
std::optional<std::vector<Monomial>> polynomial_of(const Expr& e);
/// The polynomial as an expression: sums of products.
Expr expression_of(const std::vector<Monomial>& polynomial);

/// The symbol of a sum of derivatives at cell centres: terms of odd order along an axis are 0 for waves of two cells
/// along it. Functions and products of such symbols agree with those of the derivatives. For other symbols the mean
/// over k and -k does not agree, and damps waves of two cells that the derivatives do not change.
Expr with_slopes(const Expr& symbol);
/// Whether the symbol has terms of odd order along an axis.
bool holds_odd_powers(const Expr& symbol);
/// The multiplier of the transposed operator: k is replaced by -k.
Multiplier transposed(Multiplier multiplier);
/// Calls `f` on argument and factor; the argument counts only where there is a function.
void for_each_symbol(const Transform& transform, const std::function<void(const Expr&)>& f);
/// Parameters of the transform except wave numbers, in order of first appearance.
std::vector<std::string> params_of(const Transform& transform);
/// The axes whose wave numbers occur in the symbol.
std::array<bool, max_rank> axes_of(const Expr& symbol);
/// The axes of all multipliers; all axes if the transform truncates waves.
std::array<bool, max_rank> axes_of(const Transform& transform, std::size_t rank);

}  // namespace dpde::stencil
