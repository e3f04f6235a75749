// SPDX-License-Identifier: Apache-2.0
// The smallest program that still fails: parts are dropped, one at a time, as long as the failure stays.
#pragma once

#include <functional>

#include "random/random_program.h"

namespace dpde::testing {

/// `fails` holds for `program` and for what is returned; it is asked about well-typed programs only, at most `most`
/// times and not after so many seconds.
RandomProgram shrink(RandomProgram program, const std::function<bool(const RandomProgram&)>& fails, int most = 3000,
                     double seconds = 60);

}  // namespace dpde::testing
