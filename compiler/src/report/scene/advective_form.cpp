// SPDX-License-Identifier: Apache-2.0
#include "report/scene/advective_form.h"

#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"

namespace dpde::report {

namespace {

/// Name of the vector that a state belongs to; "" for a scalar.
std::string vector_of(const std::string& state) {
  const std::size_t dot = state.find('.');
  return dot == std::string::npos ? "" : state.substr(0, dot);
}

/// Whether `e` is the vector's component on the faces normal to the axis.
bool is_normal_velocity(const model::Problem& problem, const std::string& vector, const model::Expr& e,
                        std::size_t axis) {
  const model::Field* field = as<model::Field>(e);
  const model::State* state = field == nullptr ? nullptr : problem.find_state(field->name);
  return state != nullptr && state->placement[axis] && vector_of(state->name) == vector;
}

bool is_bound(const model::Problem& problem, const std::string& state) {
  return std::ranges::any_of(problem.projections, [&](const model::Projection& projection) {
    return !projection.multiplier.empty() &&
           std::ranges::find(projection.updates, state, &model::Event::Update::state) != projection.updates.end();
  });
}

/// Whether the state is a component of the velocity that advects it.
bool carries_itself(const model::Problem& problem, const model::State& state, const model::Advect& advect) {
  const model::Field* carried = as<model::Field>(advect.operand);
  const std::string vector = vector_of(state.name);
  if (vector.empty() || carried == nullptr || carried->name != state.name || !is_bound(problem, state.name))
    return false;
  for (std::size_t axis = 0; axis < advect.velocity.size(); ++axis) {
    if (!is_normal_velocity(problem, vector, advect.velocity[axis], axis)) return false;
  }
  return std::ranges::find(advect.velocity, advect.operand) != advect.velocity.end() &&
         model::transport_of(problem.scheme, advect).advect == model::Advection::central &&
         !std::ranges::all_of(state.placement, [](bool is_staggered) { return !is_staggered; });
}

}  // namespace

std::vector<std::string> advective_velocities(const model::Problem& problem) {
  std::vector<std::string> names;
  for (const model::State& state : problem.states) {
    const bool is_found =
        state.rhs && any_part(*state.rhs, [&](const model::Expr& e) {
          const model::Advect* advect = as<model::Advect>(e);
          return advect != nullptr && !model::is_spectral(problem.scheme, e) && carries_itself(problem, state, *advect);
        });
    const std::string vector = vector_of(state.name);
    if (is_found && std::ranges::find(names, vector) == names.end()) names.push_back(vector);
  }
  return names;
}

std::string flux_form_text(const std::vector<std::string>& velocities) {
  std::string text;
  for (const std::string& name : velocities) {
    text += fmt::format(
        "momentum: -div(outer(interpolate({0}), interpolate({0}))) in place of -advect({0}, {0}) conserves it; by "
        "central(2) it had half the error in a cavity\n",
        name);
  }
  return text;
}

}  // namespace dpde::report
