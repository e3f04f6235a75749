// SPDX-License-Identifier: Apache-2.0
// States that depend on one another, and are judged together: what grows by right in one equation excuses nothing in
// another that does not know of it.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stability {

/// By name; none stands for all states.
using StateGroup = std::set<std::string>;

/// The strongly connected parts of what depends on what in a step, in the order of their first states. Where all hang
/// together it is one group without names.
std::vector<StateGroup> state_groups(const stencil::Module& module, const std::string& step);

/// Whether it is one of the group.
inline bool is_in(const StateGroup& group, const std::string& state) { return group.empty() || group.contains(state); }

}  // namespace dpde::stability
