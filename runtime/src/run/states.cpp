// SPDX-License-Identifier: Apache-2.0
#include "run/states.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "dpde/runtime/communicator.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"

namespace dpde {

int64_t BufferPlan::fields() const { return std::accumulate(of_state.begin(), of_state.end(), int64_t{0}); }

States::States(const ResolvedSetup& setup, RunMemory& memory) : layout_(setup.layout), ranks_(setup.ranks) {
  if (setup.step == nullptr) throw Error(ErrorKind::run, "a rollout needs a step program");
  const dpde_program& program = setup.trial != nullptr ? *setup.trial : *setup.step;
  if (setup.trial != nullptr && (program.sum_count != 1 || !(setup.first_part > 0) || setup.error_order < 1))
    throw Error(ErrorKind::run, fmt::format("program {} does not estimate the error of its step", program.name));
  for (int s = 0; s < program.swap_count; ++s) {
    ids_.now.push_back(setup.ids(program).fields[static_cast<size_t>(program.swaps[s].state)]);
    ids_.next.push_back(setup.ids(*setup.step).fields[static_cast<size_t>(setup.step->swaps[s].next)]);
    memory.add_initial(layout_, s);
    if (!memory.is_plan()) initial_.emplace_back(layout_, s);
  }
}

void States::allocate(const BufferPlan& plan, RunMemory& memory, const std::string& folder) {
  pool_ = memory.pool(layout_, plan.fields(), folder);
  if (memory.is_plan()) return;
  buffers_.emplace_back();
  for (Field& field : initial_) buffers_.front().push_back(field.base());
  int64_t next = 0;
  for (int64_t b = 0; b < plan.count; ++b) {
    StateBuffer buffer;
    for (size_t s = 0; s < count(); ++s) {
      const size_t same = static_cast<size_t>(plan.over[s] != 0 ? b : b - 2);
      buffer.push_back(b < plan.of_state[s] ? pool_.base(next++) : buffers_[same][s]);
    }
    buffers_.push_back(std::move(buffer));
  }
  given_.assign(buffers_.begin(), buffers_.begin() + std::min<std::ptrdiff_t>(std::ssize(buffers_), 4));
}

void States::go_to_first() {
  current_ = 0;
  std::ranges::copy(given_, buffers_.begin());
}

void States::place(int number, int kept, const std::vector<char>& may_be_over, bool is_over) {
  const bool is_here = is_over && current_ != 0 && current_ != kept;
  for (size_t s = 0; s < count(); ++s) {
    if (may_be_over[s] == 0) continue;
    void*& place = buffers_[static_cast<size_t>(number)][s];
    place = now()[s];
    for (size_t b = 1; b < given_.size() && !is_here && (place == now()[s] || place == buffer(kept)[s]); ++b)
      place = given_[b][s];
  }
}

int States::index_of(ValueId id) const {
  const auto found = std::ranges::find(ids_.now, id);
  return found == ids_.now.end() ? -1 : static_cast<int>(found - ids_.now.begin());
}

int States::free_buffer(int kept) const {
  int number = 1;
  while (number == current_ || number == kept) ++number;
  return number;
}

void States::copy_first() {
  go_to_first();
  current_ = 1;
  for (size_t s = 0; s < count(); ++s) copy_all(layout_, now()[s], first()[s]);
}

/// With ranks: the bad cell with the smallest number in the whole grid.
std::optional<Cell> States::find_bad_cell(const void* state, double& value) const {
  const std::optional<Cell> own = find_not_finite(layout_, state);
  if (own) value = value_at(layout_, state, *own);
  if (ranks_ == nullptr) return own;
  const Cell there = own.value_or(Cell{});
  const auto [x, y, z] = std::array{there.x + layout_.first[0], there.y + layout_.first[1], there.z + layout_.first[2]};
  const double number = own ? static_cast<double>((z * layout_.global[1] + y) * layout_.global[0] + x) : INFINITY;
  const double first = -largest_of(ranks_, -number);
  if (std::isinf(first)) return std::nullopt;
  value = first == number ? value : 0;
  ranks_->sum({&value, 1});
  const auto cell = static_cast<int64_t>(first), row = cell / layout_.global[0];
  return Cell{cell % layout_.global[0], row % layout_.global[1], row / layout_.global[1]};
}

std::optional<BlowUp> States::find_blow_up(int step, double t, const StateBuffer& state) const {
  for (size_t i = 0; i < state.size(); ++i) {
    double value = 0;
    if (const std::optional<Cell> cell = find_bad_cell(state[i], value))
      return BlowUp{step, t, static_cast<int>(i), *cell, value};
  }
  return std::nullopt;
}

const StateBuffer& PartStates::operator[](int number) {
  while (buffers_.size() <= static_cast<size_t>(number)) {
    pools_.emplace_back(layout_, static_cast<int64_t>(states_));
    StateBuffer& buffer = buffers_.emplace_back();
    for (size_t s = 0; s < states_; ++s) buffer.push_back(pools_.back().base(static_cast<int64_t>(s)));
  }
  return buffers_[static_cast<size_t>(number)];
}

}  // namespace dpde
