// SPDX-License-Identifier: Apache-2.0
// Names of i times the wave numbers along x, y and z, only in multipliers of transforms. The last three are 0 for a
// wave of two cells along the axis, as for first derivatives at cell centres.
#pragma once

#include <string_view>

namespace dpde {

inline constexpr std::string_view wave_names[] = {"ikx", "iky", "ikz", "ikx0", "iky0", "ikz0"};

/// Added to a power of i*angle in loop::Monomial if a factor is one of the last three names, and so 0 for waves of two
/// cells along the axis. Larger than all powers, and even, so that the parity of the power is kept.
inline constexpr int vanishes_for_shortest = 32;

}  // namespace dpde
