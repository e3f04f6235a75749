// SPDX-License-Identifier: Apache-2.0
#include "exec/passes.h"

#include <algorithm>

namespace dpde {

void Stack::make(const dpde_layout& layout) {
  memory_ = FieldPool(layout, fields_);
  slots_.resize(static_cast<std::size_t>(passes_));
}

Passes::Passes(const dpde_repeat& source, std::vector<Stack>& stacks)
    : count_(source.count),
      first_(source.first),
      step_(source.step),
      counter_(static_cast<std::size_t>(source.counter)) {
  for (int i = 0; i < source.carry_count; ++i) carried_.push_back({source.carries[i]});
  for (int i = 0; i < source.load_count; ++i) loaded_.push_back({source.loads[i]});
  for (int i = 0; i < source.save_count; ++i) {
    const dpde_stacked& save = source.saves[i];
    Stack& stack = stacks[static_cast<std::size_t>(save.stack)];
    stack.set_passes(count_);
    const auto carried = std::ranges::find_if(carried_, [&](const Carried& c) { return c.names.state == save.field; });
    if (stack.fields() == 0) {
      elsewhere_.push_back(save);
    } else if (carried != carried_.end()) {
      carried->stack = save.stack;
    } else {
      written_.push_back(save);
    }
  }
  places_.resize(written_.size());
}

void Passes::begin(void** fields) {
  for (Carried& c : carried_) {
    c.state = fields[c.names.state];
    c.next = fields[c.names.next];
  }
  for (Loaded& l : loaded_) l.field = fields[l.names.field];
  for (std::size_t i = 0; i < written_.size(); ++i) places_[i] = fields[written_[i].field];
}

void Passes::before(std::int64_t pass, void** fields, std::vector<Stack>& stacks) const {
  const std::int64_t left = count_ - 1 - pass;
  for (const Loaded& l : loaded_) fields[l.names.field] = stacks[static_cast<std::size_t>(l.names.stack)].slot(left);
  for (const dpde_stacked& save : written_) {
    Stack& stack = stacks[static_cast<std::size_t>(save.stack)];
    fields[save.field] = stack.slot(pass) = stack.memory(pass);
  }
  for (const dpde_stacked& save : elsewhere_)
    stacks[static_cast<std::size_t>(save.stack)].slot(pass) = fields[save.field];
  for (const Carried& c : carried_) {
    Stack* stack = c.stack < 0 ? nullptr : &stacks[static_cast<std::size_t>(c.stack)];
    if (stack != nullptr) stack->slot(pass) = fields[c.names.state];
    void* to = left % 2 == 0 ? fields[c.names.result] : c.next;
    fields[c.names.next] = stack != nullptr && left > 0 ? stack->memory(pass) : to;
  }
}

void Passes::after(void** fields) const {
  for (const Carried& c : carried_) fields[c.names.state] = fields[c.names.next];
}

void Passes::end(void** fields) const {
  for (const Carried& c : carried_) {
    fields[c.names.state] = c.state;
    fields[c.names.next] = c.next;
  }
  for (const Loaded& l : loaded_) fields[l.names.field] = l.field;
  for (std::size_t i = 0; i < written_.size(); ++i) fields[written_[i].field] = places_[i];
}

}  // namespace dpde
