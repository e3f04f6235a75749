// SPDX-License-Identifier: Apache-2.0
// Steps that are a polynomial R(dt L) of their rates L, as those of explicit Runge-Kutta methods with frozen
// coefficients: their eigenvalues are R(dt s), where s are those of L.
#pragma once

#include <vector>

#include "stability/amplification.h"

namespace dpde::stability {

/// Whether `g` is that step; the polynomial is given by powers. By one wave that is like no other: both sides are sums
/// of exponentials of its angles, which agree there by chance only if they do everywhere. To rounding, in units in
/// which all states are alike.
bool is_step_of_rates(const Amplification& g, const Amplification& rates, const std::vector<double>& polynomial,
                      double step);

}  // namespace dpde::stability
