// SPDX-License-Identifier: Apache-2.0
// The growth that a step may give a Fourier mode where the equations themselves have growing solutions.
#pragma once

#include <Eigen/Core>

#include "stability/waves/amplification.h"

namespace dpde::stability {

/// Growth rates below this fraction of the largest eigenvalue are rounding.
inline constexpr double no_growth = 1e-10;

/// True for waves of at least eight cells along each axis. Shorter waves may grow by the differences, not by the
/// equations: downwind differences of advection are an example.
bool is_resolved(const Angles& a);

struct AllowedGrowth {
  double growth = 0;              // largest real part of the equations' eigenvalues over all waves; 0: none grows
  bool are_all_resolved = false;  // Fourier series represent every wave exactly

  /// Allowed ln |g| / dt of a wave whose largest growth rate is `own`. It never decreases with `growth`.
  double rate_of(const Angles& wave, double own) const;
  /// Rates above -slowest_decay() do not count as decaying: the errors of a step may give them either sign.
  double slowest_decay() const;
};

/// ln of the largest factor after the `others` largest; -infinity if there is none.
double growth_behind(std::size_t others, const Eigen::VectorXcd& factors);

}  // namespace dpde::stability
