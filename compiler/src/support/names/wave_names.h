// SPDX-License-Identifier: Apache-2.0
// What stands for i times the wave numbers along x, y and z in the multipliers of transforms, and nowhere else; the
// last three are 0 for a wave of two cells along the axis, as first derivatives are at the centres of cells.
#pragma once

#include <string_view>

namespace dpde {

inline constexpr std::string_view wave_names[] = {"ikx", "iky", "ikz", "ikx0", "iky0", "ikz0"};

/// Added to a power of i*angle in loop::Monomial where one factor is that of the last three names: it is 0 for waves of
/// two cells along the axis. It is above all powers, and even, as parity is that of the power.
inline constexpr int vanishes_for_shortest = 32;

}  // namespace dpde
