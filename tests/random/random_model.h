// SPDX-License-Identifier: Apache-2.0
// Random .dpde texts: a matching model, scheme, scene and task. Constructs that are refused for known reasons are
// avoided, and values stay of order one for the few steps of the run. So each failure is a fault of the compiler.
#pragma once

#include <cstdint>

#include "random/text_tree.h"

namespace dpde::testing {

/// A text with scene `s` and task `t`; the same for the same seed on all machines.
Part random_model(std::uint64_t seed);

}  // namespace dpde::testing
