// SPDX-License-Identifier: Apache-2.0
// How a program amplifies rounding, by the reference interpreter.
#pragma once

#include "stencil/stencil.h"

namespace dpde::stencil {

/// The module with the result of every operation off by up to `size` of it, otherwise at each node and place: how far
/// its results are from those of the module measures how it amplifies rounding (stochastic arithmetic, as in CADNA).
/// Operands of decisions are as they were: all back ends compute them as they are written, so what a tie decides is no
/// matter of rounding.
Module with_rounding(Module module, double phase = 1.7, double size = 1e-15);

}  // namespace dpde::stencil
