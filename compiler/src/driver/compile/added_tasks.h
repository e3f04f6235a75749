// SPDX-License-Identifier: Apache-2.0
// Tasks that nobody wrote: they ask for derivatives alone, with data that have no source.
#pragma once

#include "model/model.h"

namespace dpde::driver {

/// Unknown: every state, and every parameter that no coefficient's formula holds. Loss: sum of u_probe*(u + u^2/2) over
/// the states, so that a linear scene too has a remainder of second order.
void add_certifying_task(model::Problem& problem);

/// The problem has a task. Its loss becomes sum(u_seed*u) over the states at the end, with a datum u_seed for each of
/// them in their order: the gradient is the transposed derivative of the end by the unknowns, times the seeds.
void seed_the_end(model::Problem& problem);

}  // namespace dpde::driver
