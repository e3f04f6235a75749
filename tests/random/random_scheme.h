// SPDX-License-Identifier: Apache-2.0
// The scheme block of a random model.
#pragma once

#include <string>
#include <vector>

#include "support/split_mix.h"

namespace dpde::testing {

/// Properties of a scheme that restrict the equations.
struct Scheme {
  std::string time, advect, split;  // split: "" where the step is one
  bool along_flow = false;          // semi-Lagrangian or MacCormack
  bool second_order = false;        // a scheme for dt(dt(u))
  bool remembers = false;           // ab2, ab3, leapfrog
  bool solves = false;              // implicit: the first field diffuses
};
Scheme random_scheme(SplitMix& random, SplitMix& parts);
/// Its rows, in some of which one of the fields has a transport of its own.
std::vector<std::string> scheme_rows(const Scheme& scheme, const std::vector<std::string>& fields, SplitMix& random,
                                     SplitMix& parts);

}  // namespace dpde::testing
