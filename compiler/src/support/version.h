// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dpde {

inline constexpr const char* version = "dpde 0.1";

}  // namespace dpde
