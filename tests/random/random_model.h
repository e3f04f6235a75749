// SPDX-License-Identifier: Apache-2.0
// Random .dpde texts: a model, a scheme, a scene and a task that go together. What is refused for known reasons is
// avoided, and values stay of order one for the few steps of the run: what goes wrong is the compiler's.
#pragma once

#include <cstdint>

#include "random/text_tree.h"

namespace dpde::testing {

/// With scene `s` and task `t`; the same for the same seed, everywhere.
Part random_model(std::uint64_t seed);

}  // namespace dpde::testing
