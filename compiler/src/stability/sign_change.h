// SPDX-License-Identifier: Apache-2.0
// Where a function of one number changes its sign.
#pragma once

#include <functional>

namespace dpde::stability {

struct SignChange {
  double low = 0, high = 0;  // f(low) <= 0 < f(high)
  double width() const { return high - low; }
};

/// Of a function that is not above 0 at `low`, where it is `f_low`, and above it at `high`: until these are no farther
/// apart than `precision` times `high`. By inverse quadratic interpolation where that is one to one between the last
/// three points, else by halves (T. R. Chandrupatla, Adv. Eng. Software 28 (1997) 145).
SignChange sign_change(const std::function<double(double)>& f, double low, double f_low, double high, double f_high,
                       double precision);

}  // namespace dpde::stability
