// SPDX-License-Identifier: Apache-2.0
// Finds a small program that still fails, by dropping parts one at a time as long as the failure stays.
#pragma once

#include <functional>

#include "random/random_program.h"

namespace dpde::testing {

/// `fails` is true for `program` and for the result. It is called with well-typed programs only, at most `most` times,
/// and not after the time limit in seconds.
RandomProgram shrink(RandomProgram program, const std::function<bool(const RandomProgram&)>& fails, int most = 3000,
                     double seconds = 60);

}  // namespace dpde::testing
