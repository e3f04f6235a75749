// SPDX-License-Identifier: Apache-2.0
#include "driver/directions.h"

#include <span>

namespace dpde::driver {

using Kind = adjoint::Link::Kind;

std::string Directions::dot_of(const std::string& primal, adjoint::Link::Kind kind, const std::string& name) const {
  const auto& all = session_.compiled().derived;
  const auto derived = all.find(primal);
  if (derived == all.end() || !derived->second.tangent) return "";
  const std::string* const found = derived->second.tangent->derived(kind, name);
  return found == nullptr ? "" : *found;
}

void Directions::assign(const Eigen::VectorXd& x, const Eigen::VectorXd& d) {
  inverse_.assign(x);
  for (const auto& [primal, derived] : session_.compiled().derived) {
    for (const Inverse::Part& part : inverse_.parts()) {
      const std::string dot = part.is_field() ? "" : dot_of(primal, Kind::param, part.name);
      if (!dot.empty()) inverse_.set_values(dot, part, d);
    }
  }
  run_formulas(x, d);
}

/// The rates of fields that formulas give; then those of fields that are unknowns themselves.
void Directions::run_formulas(const Eigen::VectorXd& x, const Eigen::VectorXd& d) {
  Workspace& workspace = session_.workspace();
  for (const std::string& formula : session_.compiled().formula_programs()) {
    const dpde_program* program = session_.compiled().tangent_of(formula);
    if (program != nullptr) workspace.run(*program, session_.problem().t_begin);
  }
  const std::string& initial = session_.compiled().names.initial;
  for (int s = 0; s < session_.rollout().state_count(); ++s) {
    const std::string& state = session_.rollout().state_name(s);
    const std::string dot = dot_of(initial, Kind::field, state);
    state_rates_[state] = dot.empty() ? std::vector<double>(workspace.cell_count()) : workspace.dense(dot);
  }
  for (const Inverse::Part& part : inverse_.parts()) {
    if (!part.is_field()) continue;
    const std::span<const double> rates(d.data() + part.offset, static_cast<std::size_t>(part.size));
    if (part.is_initial()) {
      state_rates_[part.name].assign(rates.begin(), rates.end());
      continue;
    }
    workspace.set_dense(part.name, {x.data() + part.offset, rates.size()});  // a formula has written it
    for (const auto& [primal, derived] : session_.compiled().derived) {
      const std::string dot = dot_of(primal, Kind::field, part.name);
      if (dot.empty()) continue;
      workspace.make_like(dot, part.name);
      workspace.set_dense(dot, rates);
    }
  }
}

void Directions::start(Rollout& rollout) const {
  session_.set_values(rollout);
  const std::string step = session_.compiled().step_name();
  for (int s = 0; s < rollout.state_count(); ++s) {
    const std::string& name = rollout.state_name(s);
    const int own = session_.rollout().state_index(name);
    if (own >= 0) rollout.initial(s).copy_in(session_.initial(own));
    for (const auto& [state, rates] : state_rates_) {
      if (name == dot_of(step, Kind::field, state)) rollout.initial(s).copy_in(rates);
    }
  }
}

}  // namespace dpde::driver
