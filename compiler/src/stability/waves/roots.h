// SPDX-License-Identifier: Apache-2.0
// Roots of polynomials of low degree.
#pragma once

#include <array>
#include <complex>
#include <span>

namespace dpde::stability {

inline constexpr std::size_t most_roots = 3;

/// The roots of x^n + c[n-1] x^(n-1) + ... + c[0], n up to most_roots; further entries are 0. In closed form, as they
/// are needed hundreds of thousands of times. Accurate to rounding relative to the largest root; multiple roots to a
/// root of rounding.
std::array<std::complex<double>, most_roots> roots_of(std::span<const std::complex<double>> c);

}  // namespace dpde::stability
