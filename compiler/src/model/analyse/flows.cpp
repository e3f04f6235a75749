// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/flows.h"

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/names/names.h"

namespace dpde::model {

namespace {

bool is_velocity(const Problem& problem, const State& component) {
  const auto advects_itself = [&](const Expr& part) {
    const auto* advect = std::get_if<Advect>(&part->kind);
    return advect != nullptr && advect->operand == field(component.name) &&
           advect->velocity.front() == field(component.name);
  };
  const bool is_corrected = std::ranges::any_of(problem.projections, [&](const Projection& projection) {
    const auto& updates = projection.updates;
    return !projection.multiplier.empty() &&
           std::ranges::find(updates, component.name, &Event::Update::state) != updates.end();
  });
  return is_corrected || (component.rhs && any_part(*component.rhs, advects_itself));
}

}  // namespace

std::vector<std::string> flows_in_plane(const Problem& problem) {
  std::vector<std::string> flows;
  if (problem.axes.size() != 2 || problem.metric) return flows;
  for (const State& state : problem.states) {
    const std::string vector = vector_of(state.name);
    const bool is_first = state.name == vector + ".x" && problem.find_state(vector + ".y") != nullptr;
    if (is_first && is_velocity(problem, state)) flows.push_back(vector);
  }
  return flows;
}

}  // namespace dpde::model
