// SPDX-License-Identifier: Apache-2.0
// Programs without their repeats, for who asks what they read and write. Repeats are resolved (repeats.h).
#pragma once

#include <functional>
#include <vector>

#include "syntax/ast.h"

namespace dpde::ast {

/// The items of a program of the file without its repeats: those of the blocks in their place, but for what holds from
/// pass to pass. Of what blocks load only that is left which is read nowhere else, so that nobody gives it.
std::vector<Item> without_blocks(const File& file, const std::vector<Item>& items);

/// Whether kernels that run in the repeat add to the field.
bool adds_to(const File& file, const RepeatItem& repeat, const std::string& field);

/// `f` on each, those of repeats after the repeat.
void for_each_item(const std::vector<Item>& items, const std::function<void(const Item&)>& f);

}  // namespace dpde::ast
