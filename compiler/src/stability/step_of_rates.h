// SPDX-License-Identifier: Apache-2.0
// Steps that are a polynomial R(dt L) of their rates L, as those of explicit Runge-Kutta methods with frozen
// coefficients: their eigenvalues are R(dt s), where s are those of L.
#pragma once

#include <vector>

#include "stability/amplification.h"

namespace dpde::stability {

/// Whether `g` is that step; the polynomial is given by powers. By one wave that is like no other: where both sides are
/// sums of exponentials of its angles they agree there by chance only if they do everywhere. To rounding, in units in
/// which all states are alike. False where either is no such sum, as no wave stands for all others then: a mean is
/// there only for waves that do not vary along its axes, a dealiased term only for long ones, a slope of a Fourier
/// series not for those of two cells, and a solve gives nothing to those that its operator takes to 0.
bool is_step_of_rates(const Amplification& g, const Amplification& rates, const std::vector<double>& polynomial,
                      double step);

}  // namespace dpde::stability
