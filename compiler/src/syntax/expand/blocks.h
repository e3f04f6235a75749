// SPDX-License-Identifier: Apache-2.0
// Programs with their repeats flattened, to analyse what they read and write. Requires resolved repeats (repeats.h).
#pragma once

#include <functional>
#include <vector>

#include "syntax/ast.h"

namespace dpde::ast {

/// The program's items with the items of blocks in place of the blocks, without swaps and stacks in them. A load is
/// kept only if its field is read nowhere else, i.e. is not an input.
std::vector<Item> without_blocks(const File& file, const std::vector<Item>& items);

/// Whether kernels in the repeat add to the field.
bool adds_to(const File& file, const RepeatItem& repeat, const std::string& field);

/// Calls `f` on each item; items of a block follow its item.
void for_each_item(const std::vector<Item>& items, const std::function<void(const Item&)>& f);

}  // namespace dpde::ast
