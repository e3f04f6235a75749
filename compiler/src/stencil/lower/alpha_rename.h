// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stencil/lower/lowering.h"
#include "support/names/name_supply.h"

namespace dpde::stencil {

/// Reductions of one stage know nothing of those of another: gives the fields of each names of their own, but for those
/// that stand for states.
std::vector<Stage> with_own_names(std::vector<Stage> stages, NameSupply taken,
                                  const std::map<std::string, std::string>& state_of);

}  // namespace dpde::stencil
