// SPDX-License-Identifier: Apache-2.0
#include "solve/multigrid/smoother.h"

#include <cmath>
#include <numbers>

namespace dpde {

std::array<double, 2> factors_of(SmootherKind smoother, double least_share) {
  const double middle = (2 + least_share) / 2, half = (2 - least_share) / 2;
  const double away = smoother == SmootherKind::chebyshev ? half * std::cos(std::numbers::pi / 4) : 0;
  return {1 / (middle + away), 1 / (middle - away)};
}

}  // namespace dpde
