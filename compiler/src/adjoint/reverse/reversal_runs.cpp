// SPDX-License-Identifier: Apache-2.0
// Transposes of kernel runs, and the primal fields that they read.
#include <algorithm>

#include "adjoint/reverse/adjoint_kernel.h"
#include "adjoint/reverse/reversal.h"
#include "stencil/analyse/extents.h"
#include "stencil/build.h"
#include "stencil/passes/place_fills.h"

namespace dpde::adjoint {

using namespace stencil;

void Reversal::reverse_run(const Run& primal, int index) {
  const Kernel& kernel = *module_.find_kernel(primal.kernel);
  const RunContext context{program_.axes, primal.grow, std::max(reach_, primal.grow),
                           [&](const std::string& field) { return seed(field, primal.grow); },
                           [&](const std::string& field) { return bars_.contains(field); }};
  KernelAdjoint derived = adjoint_of(kernel, varied_, context, names_);
  note_needs(derived.shared, index);
  note_needs(derived.gather, index, derived.stored);
  note_needs(derived.scatter, index);
  for (const Store& store : kernel.stores) {
    if (!store.accumulate) consumed_.push_back(store.field);
  }
  for (const Kernel* part : {&derived.shared, &derived.gather}) check_halos(kernel, *part, primal.grow);
  if (!derived.shared.stores.empty()) run(std::move(derived.shared), derived.shared_grow);
  for (const std::string& field : derived.stored) state_around(field);
  if (!derived.gather.stores.empty() || !derived.gather.sums.empty())
    run(std::move(derived.gather), context.target_grow);
  if (!derived.scatter.scatters.empty()) run(std::move(derived.scatter), primal.grow);
  const std::map<std::string, int> extents = extents_of(kernel, primal.grow, program_.axes);
  for (const std::string& field : derived.contributed) contribute(kernel, field, extents, context.target_grow);
  for (const std::string& field : consumed_) bars_.erase(field);
  consumed_.clear();
}

void Reversal::contribute(const Kernel& kernel, const std::string& field, const std::map<std::string, int>& extents,
                          int target_grow) {
  Bar& bar = bars_.try_emplace(field, Bar{target_grow}).first->second;
  const auto extent = extents.find(field);
  bar = {std::min(bar.grow, target_grow), false, std::max(bar.extent, extent == extents.end() ? 0 : extent->second)};
  if (bar.extent > bar.grow)
    refused.emplace(kernel.name, "reading " + field + " beyond walls before it is added to or folded");
}

void Reversal::check_halos(const Kernel& primal, const Kernel& gather, int grow) {
  if (!has_bounded_axis(program_.axes)) return;
  const std::set<std::string> around = read_around(gather, program_.axes);
  for (const auto& [field, bar] : bars_) {
    if (bar.is_around || bar.grow == 0 || !around.contains(names_.of(field))) continue;
    const bool is_consumed = std::find(consumed_.begin(), consumed_.end(), field) != consumed_.end();
    const bool is_target = std::any_of(primal.scatters.begin(), primal.scatters.end(),
                                       [&](const Scatter& scatter) { return scatter.target.field == field; });
    if (grow == 0 && (bar.extent == 0 || (is_consumed && !is_target))) continue;
    refused.emplace(primal.name,
                    "reading neighbours around a periodic axis for " + field + ", which is read beyond walls");
  }
  for (const Scatter& scatter : primal.scatters) {
    const auto bar = bars_.find(scatter.target.field);
    if (bar == bars_.end() || bar->second.grow >= reach_of(scatter.target, program_.axes)) continue;
    refused.emplace(primal.name, "interp(" + bar->first + ") += before it is read around a periodic axis or folded");
  }
  for (const Signature::Read& read : signature(gather).reads) {
    const bool is_grown = grown_.contains(read.field) && !fills_.contains(read.field);
    if (!is_grown || !around.contains(read.field)) continue;
    refused.emplace(primal.name,
                    "reading " + read.field + ", computed beyond walls and not filled, beside a periodic axis");
  }
}

std::optional<Expr> Reversal::seed(const std::string& field, int grow) const {
  const auto bar = bars_.find(field);
  if (bar == bars_.end()) return std::nullopt;
  const Expr value = access(names_.of(field));
  const bool reaches = bar->second.grow >= grow || !has_bounded_axis(program_.axes);
  return reaches ? value : select(inside({}, bar->second.grow), value, 0.0);
}

void Reversal::run(Kernel kernel, int grow) {
  const std::set<std::string> around = read_around(kernel, program_.axes);
  for (auto& [field, bar] : bars_) {
    if (bar.is_around || !around.contains(names_.of(field))) continue;
    state_around(names_.of(field));
    bar = {0, true, 0};
  }
  body.push_back(Run{kernel.name, grow});
  kernels_.kernels.push_back(std::move(kernel));
}

void Reversal::state_around(const std::string& field) {
  if (!has_rule(halos_, field)) halos_.push_back({Fill{field, boundary_around(program_.axes)}, FillNeed::around});
}

void Reversal::note_needs(const Kernel& kernel, int index, const std::vector<std::string>& own) {
  std::set<std::string> bars(own.begin(), own.end());
  for (const auto& [primal, derived] : names_.all()) bars.insert(derived);
  for (const auto& read : signature(kernel).reads) {
    if (!bars.contains(read.field)) needed[read.field] = index;  // the earliest: statements are reversed last first
  }
}

}  // namespace dpde::adjoint
