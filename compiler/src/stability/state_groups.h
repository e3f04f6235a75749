// SPDX-License-Identifier: Apache-2.0
// Groups of states that depend on one another. Each group has a verdict of its own: physical growth in one equation
// does not excuse growth in another that does not depend on it.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stability {

/// Names of states; the empty set stands for all states.
using StateGroup = std::set<std::string>;

/// The strongly connected components of the dependences between states in a step, in the order of their first states.
/// If all states are in one component, the result is one empty set.
std::vector<StateGroup> state_groups(const stencil::Module& module, const std::string& step);

/// Whether the state is in the group.
inline bool is_in(const StateGroup& group, const std::string& state) { return group.empty() || group.contains(state); }

}  // namespace dpde::stability
