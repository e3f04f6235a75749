// SPDX-License-Identifier: Apache-2.0
#include "stencil/repeats_from_ast.h"

#include <utility>

namespace dpde::stencil {

Repeat read_repeat_head(const ast::RepeatItem& source) {
  Repeat repeat{source.count, {}, {}};
  if (source.counter) repeat.counter = {source.counter->name, source.is_backwards};
  for (const ast::Item& item : source.items) {
    if (const auto* stack = get_if<ast::StackItem>(&item.kind))
      (stack->is_save ? repeat.saves : repeat.loads).push_back({stack->field.name, stack->stack.name});
    if (const auto* swap = get_if<ast::SwapItem>(&item.kind)) {
      const std::string& result = source.to.at(repeat.carries.size()).name;
      repeat.carries.push_back({swap->state.name, swap->next.name, result});
    }
  }
  return repeat;
}

std::vector<HaloRule> halos_of_passes(const Repeat& head, std::map<std::string, Fill> filled) {
  for (const Carry& carry : head.carries) filled.erase(carry.state);
  for (const Stacked& load : head.loads) filled.erase(load.field);
  std::vector<HaloRule> halos;
  for (auto& [field, fill] : filled) halos.push_back({std::move(fill), FillNeed::beyond});
  return halos;
}

}  // namespace dpde::stencil
