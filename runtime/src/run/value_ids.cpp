// SPDX-License-Identifier: Apache-2.0
#include "run/value_ids.h"

#include <algorithm>
#include <utility>

#include "dpde/runtime/links.h"

namespace dpde {

int ProgramIds::place(const std::vector<ValueId>& ids, ValueId id) {
  const auto found = std::ranges::find(ids, id);
  return found == ids.end() ? -1 : static_cast<int>(found - ids.begin());
}

int ProgramIds::derived(int kind, ValueId primal) const {
  const auto found =
      std::ranges::find_if(links, [&](const Link& link) { return link.kind == kind && link.primal == primal; });
  return found == links.end() ? -1 : found->derived;
}

void Places::add(ValueId id, int place) {
  if (id >= static_cast<int>(places_.size())) places_.resize(static_cast<std::size_t>(id) + 1, -1);
  int& known = places_[static_cast<std::size_t>(id)];
  if (known < 0) known = place;  // the first one of that name
}

ValueIds::ValueIds() {
  add("t");
  add("dt");
}

ValueId ValueIds::add(std::string_view name) {
  if (const auto known = known_.find(name); known != known_.end()) return known->second;
  const auto id = static_cast<ValueId>(names_.size());
  known_.emplace(names_.emplace_back(name), id);
  return id;
}

ValueId ValueIds::find(std::string_view name) const {
  const auto known = known_.find(name);
  return known == known_.end() ? no_value : known->second;
}

ProgramIds ValueIds::of(const dpde_program& program) {
  ProgramIds ids;
  for (int f = 0; f < program.field_count; ++f) ids.fields.push_back(add(program.fields[f]));
  for (int p = 0; p < program.param_count; ++p) ids.params.push_back(add(program.params[p]));
  for (int s = 0; s < program.sum_count; ++s) ids.sums.push_back(add(program.sums[s]));
  for (int n = 0; n < program.network_count; ++n) ids.networks.push_back(add(program.networks[n]->name));
  for (const dpde_link& link : links_of(program)) ids.links.push_back({link.kind, add(link.primal), link.derived});
  return ids;
}

void ResolvedSetup::add(const dpde_program* program) {
  if (program != nullptr && !programs_.contains(program)) programs_.emplace(program, values_.of(*program));
}

ResolvedSetup::ResolvedSetup(RolloutSetup from) : RolloutSetup(std::move(from)) {
  for (const dpde_program* program : {step, adjoint, rate, trial}) add(program);
  for (const dpde_adjoint_variant& variant : adjoint_variants) add(variant.adjoint), add(variant.step);
  const auto place_all = [&](const auto& list, auto name, Places& places) {
    for (std::size_t i = 0; i < list.size(); ++i) places.add(values_.add(list[i].*name), static_cast<int>(i));
  };
  place_all(fields, &BoundField::name, fields_);
  place_all(params, &BoundParam::name, params_);
  place_all(control_fields, &ControlField::name, control_fields_);
  place_all(weights, &BoundWeights::network, weights_);
  for (const std::string& name : sought) {
    sought_at_.add(values_.add(name), static_cast<int>(sought_.size()));
    sought_.push_back(values_.add(name));
  }
  for (const std::string& name : rates) rates_.add(values_.add(name), 0);
  if (rate != nullptr) rate_field_ = values_.add(rate_field);
  for (const LossTerm& term : losses) {
    add(term.loss);
    add(term.adjoint);
    LossIds& ids = losses_.emplace_back();
    if (!term.sum.empty()) ids.sum = values_.add(term.sum);
    if (term.sum.empty() && term.loss != nullptr && term.loss->sum_count == 1)
      ids.sum = values_.add(term.loss->sums[0]);
    if (!term.average.empty()) {
      ids.average = values_.add(term.average);
      if (!averages_.has(ids.average)) averages_.add(ids.average, static_cast<int>(average_count_++));
    }
    for (const LossData& data : term.data) ids.data.push_back(values_.add(data.name));
  }
  let_go_of_unread();
}

void ResolvedSetup::let_go_of_unread() {
  for (BoundField& field : fields) {
    const ValueId id = values_.find(field.name);
    const auto reads = [&](const auto& program) { return program.second.field(id) >= 0; };
    if (field.keep && std::ranges::none_of(programs_, reads)) field = {.name = field.name};
  }
}

}  // namespace dpde
