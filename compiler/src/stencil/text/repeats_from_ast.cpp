// SPDX-License-Identifier: Apache-2.0
#include "stencil/text/repeats_from_ast.h"

#include <utility>

#include "stencil/analyse/effects.h"
#include "support/contains.h"

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

namespace {

std::vector<HaloRule> halos_of_passes(const Repeat& head, std::map<std::string, Fill> filled) {
  for (const LoopCarried& carry : head.carries) filled.erase(carry.state);
  for (const TapeEntry& load : head.loads) filled.erase(load.field);
  std::vector<HaloRule> halos;
  for (auto& [field, fill] : filled) halos.push_back({std::move(fill), FillNeed::beyond});
  return halos;
}

}  // namespace

PassFills::PassFills(const std::vector<Topology>& axes, const Repeat& head, const std::map<std::string, Fill>& filled)
    : halos_(halos_of_passes(head, filled)), placer_(axes, halos_) {}

void PassFills::add(const Module& module, Statement statement, std::vector<Statement>& body) {
  const std::vector<std::string> made = effects(module, statement).writes;
  placer_.add(module, std::move(statement), body);
  std::erase_if(halos_, [&](const HaloRule& rule) { return contains(made, rule.fill.field); });
}

}  // namespace dpde::stencil
