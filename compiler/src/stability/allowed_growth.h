// SPDX-License-Identifier: Apache-2.0
// What a step may let a wave grow by, where the equations let some waves grow.
#pragma once

#include <Eigen/Core>

#include "stability/waves/amplification.h"

namespace dpde::stability {

/// Of the largest rate: growth below it is rounding.
inline constexpr double no_growth = 1e-10;

/// Eight cells or more along each axis. Growth of shorter waves may be that of differences, not of the equations: a
/// wind that is looked at from behind grows so.
bool is_resolved(const Angles& a);

struct AllowedGrowth {
  double growth = 0;              // the largest real part of the equations' rates, of all waves; 0 where nothing grows
  bool are_all_resolved = false;  // Fourier series have all waves as they are

  /// ln |g| a time of a wave whose own largest rate is `own`. None falls as `growth` rises.
  double rate_of(const Angles& wave, double own) const;
  /// Rates near 0 do not decay for sure: a part of what grows most may do either by errors of a step.
  double slowest_decay() const;
};

/// ln of the largest factor behind `others` larger ones; -infinite where there is none.
double growth_behind(std::size_t others, const Eigen::VectorXcd& factors);

}  // namespace dpde::stability
