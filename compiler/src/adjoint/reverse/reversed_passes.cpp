// SPDX-License-Identifier: Apache-2.0
#include "adjoint/reverse/reversed_passes.h"

#include <algorithm>
#include <ranges>

#include "stencil/build.h"
#include "support/contains.h"

namespace dpde::adjoint {

using namespace stencil;

ReversedPasses::ReversedPasses(const Repeat& repeat, const std::vector<std::string>& reads, const Varied& varied,
                               DerivedNames& names)
    : repeat_(repeat), reads_(reads), names_(names) {
  for (const LoopCarried& carry : repeat.carries) {
    if (varied.fields.contains(carry.next)) carries_.push_back(carry);
  }
  const std::set<std::string> carried = states();
  for (const std::string& field : reads) {
    if (varied.fields.contains(field) && !carried.contains(field)) constant_.push_back(field);
  }
  for (const LoopCarried& carry : carries_) {
    call(carry.next, names_.of(carry.result));
    call(carry.state, names_.fresh(names_.of(carry.state) + "_pass"));
  }
  for (const std::string& field : constant_) call(field, names_.fresh(names_.of(field) + "_pass"));
  for (const TapeEntry& load : repeat.loads) {
    if (!varied.fields.contains(load.field)) continue;
    loads_.push_back(load);
    call(load.field, names_.fresh(names_.of(load.field) + "_pass"));
  }
}

void ReversedPasses::call(const std::string& field, const std::string& bar) {
  names_.of(field);
  outside_.emplace_back(field, names_.rebind(field, bar));
}

std::set<std::string> ReversedPasses::states() const {
  std::set<std::string> states;
  for (const LoopCarried& carry : carries_) states.insert(carry.state);
  return states;
}

bool ReversedPasses::is_state(const std::string& field) const {
  return std::ranges::any_of(repeat_.carries, [&](const LoopCarried& carry) { return carry.state == field; });
}

bool ReversedPasses::is_loaded(const std::string& field) const {
  return std::ranges::any_of(repeat_.loads, [&](const TapeEntry& load) { return load.field == field; });
}

ReversedPasses::Reads ReversedPasses::read_by(const std::vector<std::string>& fields) const {
  Reads read;
  for (const std::string& field : fields) {
    const bool differs = is_state(field) || is_loaded(field);
    if (differs || contains(reads_, field)) (differs ? read.differing : read.constant).push_back(field);
  }
  return read;
}

bool ReversedPasses::check(const std::set<std::string>& stacks, DiagnosticSink& sink) const {
  for (const TapeEntry& save : repeat_.saves) {
    if (!stacks.contains(save.stack) || is_state(save.field)) continue;
    sink.report("no-useful-derivative", {}, {"the stack " + save.stack, "of an adjoint of an adjoint"},
                "take its tangent, or the adjoint of the tangent");
    return false;
  }
  return true;
}

/// The adjoint of a state; if the state was saved, plus the adjoint of its load, added after the adjoint of the pass.
std::string ReversedPasses::with_saved(const std::string& state, const std::set<std::string>& stacks, Repeat& reversed,
                                       Kernel& add) {
  std::string bar = names_.of(state);
  for (const TapeEntry& save : repeat_.saves) {
    if (save.field != state || !stacks.contains(save.stack)) continue;
    const std::string saved = names_.fresh(bar + "_saved"), total = names_.fresh(bar + "_total");
    reversed.loads.push_back({saved, names_.of(save.stack)});
    add.stores.push_back({total, false, access(bar) + access(saved), {}});
    bar = total;
  }
  return bar;
}

std::vector<std::pair<std::string, std::string>> ReversedPasses::finish(
    Repeat& reversed, const std::function<bool(const std::string&)>& has_bar, std::set<std::string>& stacks,
    const Writing& before) {
  std::vector<std::pair<std::string, std::string>> given;
  const int rank = static_cast<int>(before.primal.axes.size());
  Kernel begin{names_.fresh_kernel(before.primal.name + "_adjoint_sums"), rank, {}, {}, {}, {}};
  Kernel add{names_.fresh_kernel(before.primal.name + "_adjoint_sum"), rank, {}, {}, {}, {}};
  for (const LoopCarried& carry : carries_) {
    given.emplace_back(carry.state, names_.fresh(names_.of(carry.state) + "_first"));
    reversed.carries.push_back(
        {names_.of(carry.next), with_saved(carry.state, stacks, reversed, add), given.back().second});
  }
  for (const std::string& field : constant_) {
    if (!has_bar(field)) continue;
    const std::string bar = names_.of(field), sum = names_.fresh(bar + "_sum"), next = names_.fresh(bar + "_next");
    given.emplace_back(field, names_.fresh(bar + "_all"));
    begin.stores.push_back({sum, false, 0.0, {}});
    add.stores.push_back({next, false, access(sum) + access(bar), {}});
    reversed.carries.push_back({sum, next, given.back().second});
  }
  for (const TapeEntry& load : loads_) {
    if (!has_bar(load.field)) continue;
    reversed.saves.push_back({names_.of(load.field), names_.of(load.stack)});
    stacks.insert(load.stack);
  }
  if (!begin.stores.empty()) {
    before.body.push_back(Run{begin.name});
    before.kernels.kernels.push_back(std::move(begin));
  }
  if (!add.stores.empty()) {
    reversed.body.push_back(Run{add.name});
    before.kernels.kernels.push_back(std::move(add));
  }
  for (const auto& [field, bar] : std::views::reverse(outside_)) names_.rebind(field, bar);
  return given;
}

}  // namespace dpde::adjoint
