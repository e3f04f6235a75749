// SPDX-License-Identifier: Apache-2.0
// Seeds of noise and weights are integers that a double represents exactly.
#pragma once

#include <cmath>

namespace dpde::model {

inline bool is_seed(double value) { return value >= 0 && value < 0x1p53 && value == std::floor(value); }

}  // namespace dpde::model
