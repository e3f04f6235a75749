// SPDX-License-Identifier: Apache-2.0
#include "syntax/expand/blocks.h"

#include <algorithm>
#include <set>
#include <string>

#include "syntax/item_kinds.h"

namespace dpde::ast {

namespace {

using Names = std::set<std::string>;

using Identifiers = std::vector<Identifier>;

/// Fields that the kernels of this name read or add to.
Identifiers inputs_of(const File& file, const std::string& name) {
  Identifiers fields;
  for (const Declaration& declaration : file.declarations) {
    const auto* kernel = std::get_if<Kernel>(&declaration.kind);
    if (!kernel || kernel->name.name != name) continue;
    for (const KernelParameter& parameter : kernel->parameters) {
      const bool is_read = parameter.role == KernelRole::in || parameter.role == KernelRole::inout;
      if (is_read) fields.push_back(parameter.name);
    }
  }
  return fields;
}

/// Fields that an item itself, not its block, reads or adds to. Fills and stacks count as none: they only access fields
/// that the program has written, and other items read the result.
Identifiers fields_read(const File& file, const Item& item) {
  return match(
      item.kind, [](const ReduceItem& reduce) { return Identifiers{reduce.field}; },
      [](const ApplyItem& apply) {
        Identifiers fields = apply.inputs;
        fields.insert(fields.end(), apply.by.begin(), apply.by.end());
        return fields;
      },
      [](const TransformItem& transform) {
        Identifiers fields;
        for (const TransformItem::Term& term : transform.terms) fields.push_back(term.field);
        return fields;
      },
      [](const SwapItem& swap) { return Identifiers{swap.state}; },
      [&](const RunItem& run) { return inputs_of(file, run.kernel.name); },
      [](const FillItem&) { return Identifiers(); }, [](const StackItem&) { return Identifiers(); },
      [](const RepeatItem&) { return Identifiers(); },
      [](const SolveItem& solve) {
        Identifiers fields = solve.rights;
        fields.insert(fields.end(), solve.guesses.begin(), solve.guesses.end());
        if (solve.network) fields.insert(fields.end(), solve.network->inputs.begin() + 1, solve.network->inputs.end());
        return fields;
      },
      [](const KeepItem&) { return Identifiers(); }, [](const AxesItem&) { return Identifiers(); },
      [](const OutsidePrograms auto&) { return Identifiers(); });
}

/// nullptr if the item has no block.
const std::vector<Item>* block_of(const Item& item) {
  using Block = const std::vector<Item>*;
  return match(
      item.kind, [](const RepeatItem& repeat) -> Block { return &repeat.items; },
      [](const SolveItem& solve) -> Block { return &solve.items; },
      [](const OneOf<FillItem, ReduceItem, TransformItem, RunItem, SwapItem, StackItem, KeepItem, AxesItem,
                     ApplyItem> auto&) -> Block { return nullptr; },
      [](const OutsidePrograms auto&) -> Block { return nullptr; });
}

const StackItem* load_of(const Item& item) {
  const auto* stack = get_if<StackItem>(&item.kind);
  return stack && !stack->is_save ? stack : nullptr;
}

/// Adds fields that are read without being loaded in an enclosing block.
void add_given(const File& file, const std::vector<Item>& items, Names loaded, Names& given) {
  for (const Item& item : items) {
    if (const StackItem* load = load_of(item)) loaded.insert(load->field.name);
  }
  for (const Item& item : items) {
    for (const Identifier& field : fields_read(file, item)) {
      if (!loaded.contains(field.name)) given.insert(field.name);
    }
    if (const auto* block = block_of(item)) add_given(file, *block, loaded, given);
  }
}

void add_flat(const std::vector<Item>& items, bool is_inside, const Names& given, std::vector<Item>& flat) {
  for (const Item& item : items) {
    const StackItem* load = load_of(item);
    if (is_inside && holds<SwapItem>(item.kind)) continue;
    if (holds<StackItem>(item.kind) && (!load || given.contains(load->field.name))) continue;
    flat.push_back(item);
    if (auto* repeat = get_if<RepeatItem>(&flat.back().kind)) repeat->items.clear();
    if (auto* solve = get_if<SolveItem>(&flat.back().kind)) solve->items.clear();
    if (const auto* block = block_of(item)) add_flat(*block, true, given, flat);
  }
}

}  // namespace

std::vector<Item> without_blocks(const File& file, const std::vector<Item>& items) {
  Names given;
  add_given(file, items, {}, given);
  std::vector<Item> flat;
  add_flat(items, false, given, flat);
  return flat;
}

bool adds_to(const File& file, const RepeatItem& repeat, const std::string& field) {
  bool found = false;
  for_each_item(repeat.items, [&](const Item& item) {
    const auto* run = get_if<RunItem>(&item.kind);
    for (const Declaration& declaration : file.declarations) {
      const auto* kernel = std::get_if<Kernel>(&declaration.kind);
      if (!run || !kernel || kernel->name.name != run->kernel.name) continue;
      found = found || std::ranges::any_of(kernel->parameters, [&](const KernelParameter& parameter) {
                return parameter.role == KernelRole::inout && parameter.name.name == field;
              });
    }
  });
  return found;
}

void for_each_item(const std::vector<Item>& items, const std::function<void(const Item&)>& f) {
  for (const Item& item : items) {
    f(item);
    if (const auto* block = block_of(item)) for_each_item(*block, f);
  }
}

}  // namespace dpde::ast
