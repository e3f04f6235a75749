// SPDX-License-Identifier: Apache-2.0
// Generated tasks that only serve to get derivatives; their data have no source.
#pragma once

#include "model/model.h"

namespace dpde::driver {

/// Adds a task. Unknowns: every state, and every parameter that no coefficient formula contains. Loss: sum of
/// u_probe*(u + u^2/2) over the states; the square gives linear scenes a second-order remainder too.
void add_certifying_task(model::Problem& problem);

/// Requires a task. Its loss becomes sum(u_seed*u) over the final states, with a datum u_seed for each state, in order.
/// The gradient is then the transposed Jacobian of the final state with respect to the unknowns, times the seeds.
void seed_the_end(model::Problem& problem);

}  // namespace dpde::driver
