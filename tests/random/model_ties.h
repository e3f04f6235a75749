// SPDX-License-Identifier: Apache-2.0
// Operators that choose between a value and that of a neighbour, for random models: fluxes of Rusanov's kind and
// limited slopes.
#pragma once

#include <string>
#include <vector>

#include "random/text_tree.h"
#include "support/split_mix.h"

namespace dpde::testing {

/// The declaration of `tie(g, s)` along one of the axes.
std::string tie_operator(SplitMix& random, const std::vector<std::string>& axes);

/// A use of it: of field `self`, with a speed made of fields that lie where it does.
Part tie_term(SplitMix& random, const std::string& self, const std::vector<std::string>& fields);

}  // namespace dpde::testing
