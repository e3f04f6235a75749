// SPDX-License-Identifier: Apache-2.0
// What stands for i times the wave numbers along x, y and z in the multipliers of transforms, and nowhere else.
#pragma once

#include <string_view>

namespace dpde {

inline constexpr std::string_view wave_names[] = {"ikx", "iky", "ikz"};

}  // namespace dpde
