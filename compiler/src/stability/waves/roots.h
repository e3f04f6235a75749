// SPDX-License-Identifier: Apache-2.0
// Roots of polynomials of low degree.
#pragma once

#include <array>
#include <complex>
#include <span>

namespace dpde::stability {

inline constexpr std::size_t most_roots = 3;

/// Of x^n + c[n-1] x^(n-1) + ... + c[0], n up to most_roots; what lies behind n is 0. In closed form: they are asked
/// for by the hundred thousand. Near to rounding, and where some are one to its root, of the largest of them.
std::array<std::complex<double>, most_roots> roots_of(std::span<const std::complex<double>> c);

}  // namespace dpde::stability
