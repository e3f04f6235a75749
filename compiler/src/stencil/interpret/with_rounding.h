// SPDX-License-Identifier: Apache-2.0
// Measures how a program amplifies rounding errors, with the reference interpreter.
#pragma once

#include "stencil/stencil.h"

namespace dpde::stencil {

/// The module with the result of every operation perturbed by up to `size` of it, differently at each node and point;
/// sums and means over axes, whose terms have no order, by up to `size` of the sum of magnitudes of their terms.
/// The difference of its results from those of `module` measures the amplification of rounding (stochastic arithmetic,
/// as in CADNA). Operands of decisions are not perturbed: all back ends compute them as written, so that rounding
/// does not decide ties.
Module with_rounding(Module module, double phase = 1.7, double size = 1e-15);

}  // namespace dpde::stencil
