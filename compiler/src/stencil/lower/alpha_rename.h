// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stencil/lower/lowering.h"
#include "support/names/name_supply.h"

namespace dpde::stencil {

/// Gives the fields of each stage unique names, except those that hold states: the names of fields for reductions and
/// the like are chosen separately in each stage.
std::vector<Stage> with_own_names(std::vector<Stage> stages, NameSupply taken,
                                  const std::map<std::string, std::string>& state_of);

}  // namespace dpde::stencil
