// SPDX-License-Identifier: Apache-2.0
// Where a run switches by what a task seeks, or by states that depend on it. A derivative knows nothing of how a switch
// moves: it is right where the branches meet, and lacks the jump where they do not.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "model/influence.h"
#include "model/model.h"

namespace dpde::model {

/// An unknown whose derivative is 0 almost everywhere though the losses change with it.
struct OnlySwitching {
  std::size_t unknown;  // its place in the task
  Origin origin;        // of a switch that it moves; unknown where it sets how long steps are
  bool sets_length = false;
};
std::vector<OnlySwitching> only_switching(const Problem& problem, const Influence& influence);

/// A choice whose value jumps where it switches.
struct Jump {
  Origin origin;
  std::string what;                 // "sign"; "" for if
  std::vector<std::string> movers;  // states, coefficients and parameters that move the switch
};
/// One for each formula that the losses hang on. Those of masks are left out, as no unknown may stand in them.
std::vector<Jump> jumps_of(const Problem& problem, const Influence& influence);

}  // namespace dpde::model
