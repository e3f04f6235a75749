// SPDX-License-Identifier: Apache-2.0
// A convolution as a sum over terms, one for each input channel and kernel offset.
#pragma once

#include "network/plan.h"

namespace dpde::nn {

/// Sets phased, phase_count, reach.
void set_reach(Convolution& convolution, const dpde_layer& layer, int32_t rank);

/// Sets the other members, once the shapes of values are known.
void plan_convolution(const Plan& plan, Step& step, const Value& result, int64_t widest_block);

}  // namespace dpde::nn
