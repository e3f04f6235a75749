// SPDX-License-Identifier: Apache-2.0
// What a repeat of the text says beside its statements.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// A repeat with an empty block.
Repeat read_repeat_head(const ast::RepeatItem& source);

/// A pass sees no halo from outside: what is the same in all passes goes on in each as it was filled before them.
/// `filled`: the last fill of each field.
std::vector<HaloRule> halos_of_passes(const Repeat& head, std::map<std::string, Fill> filled);

}  // namespace dpde::stencil
