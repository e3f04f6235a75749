// SPDX-License-Identifier: Apache-2.0
#include "syntax/blocks.h"

#include <algorithm>
#include <set>
#include <string>

namespace dpde::ast {

namespace {

using Names = std::set<std::string>;

/// The fields that an item itself, not its block, reads or adds to.
std::vector<Identifier> fields_read(const File& file, const Item& item) {
  if (const auto* reduce = std::get_if<ReduceItem>(&item.kind)) return {reduce->field};
  if (const auto* apply = std::get_if<ApplyItem>(&item.kind)) {
    std::vector<Identifier> fields = apply->inputs;
    fields.insert(fields.end(), apply->by.begin(), apply->by.end());
    return fields;
  }
  if (const auto* swap = std::get_if<SwapItem>(&item.kind)) return {swap->state};
  std::vector<Identifier> fields;
  const auto* run = std::get_if<RunItem>(&item.kind);
  for (const Declaration& declaration : file.declarations) {
    const auto* kernel = std::get_if<Kernel>(&declaration.kind);
    if (!run || !kernel || kernel->name.name != run->kernel.name) continue;
    for (const KernelParameter& parameter : kernel->parameters) {
      const bool is_read = parameter.role == KernelRole::in || parameter.role == KernelRole::inout;
      if (is_read) fields.push_back(parameter.name);
    }
  }
  return fields;
}

const StackItem* load_of(const Item& item) {
  const auto* stack = std::get_if<StackItem>(&item.kind);
  return stack && !stack->is_save ? stack : nullptr;
}

/// What is read where no block around it loads it.
void add_given(const File& file, const std::vector<Item>& items, Names loaded, Names& given) {
  for (const Item& item : items) {
    if (const StackItem* load = load_of(item)) loaded.insert(load->field.name);
  }
  for (const Item& item : items) {
    for (const Identifier& field : fields_read(file, item)) {
      if (!loaded.contains(field.name)) given.insert(field.name);
    }
    if (const auto* repeat = std::get_if<RepeatItem>(&item.kind)) add_given(file, repeat->items, loaded, given);
  }
}

void add_flat(const std::vector<Item>& items, bool is_inside, const Names& given, std::vector<Item>& flat) {
  for (const Item& item : items) {
    const StackItem* load = load_of(item);
    if (is_inside && std::holds_alternative<SwapItem>(item.kind)) continue;
    if (std::holds_alternative<StackItem>(item.kind) && (!load || given.contains(load->field.name))) continue;
    flat.push_back(item);
    const auto* repeat = std::get_if<RepeatItem>(&item.kind);
    if (!repeat) continue;
    std::get<RepeatItem>(flat.back().kind).items.clear();
    add_flat(repeat->items, true, given, flat);
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

void for_each_item(const std::vector<Item>& items, const std::function<void(const Item&)>& f) {
  for (const Item& item : items) {
    f(item);
    if (const RepeatItem* repeat = std::get_if<RepeatItem>(&item.kind)) for_each_item(repeat->items, f);
  }
}

}  // namespace dpde::ast
