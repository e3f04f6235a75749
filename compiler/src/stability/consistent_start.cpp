// SPDX-License-Identifier: Apache-2.0
#include "stability/consistent_start.h"

#include <algorithm>

#include "stability/equations.h"
#include "stability/zero_step.h"

namespace dpde::stability {

namespace {

/// The states that a step sets somewhere, whatever they were.
bool is_set_by_steps(const model::Problem& problem, const std::string& state) {
  return problem.is_projected(state) || std::ranges::any_of(problem.events, [&](const model::Event& event) {
           return is_of_each_step(event, problem) &&
                  std::ranges::find(event.updates, state, &model::Event::Update::state) != event.updates.end();
         });
}

}  // namespace

ConsistentStart::ConsistentStart(driver::Session& session) : session_(session) {
  const driver::Compiled& compiled = session.compiled();
  std::vector<std::string> fields;
  std::vector<int> states;
  for (const stencil::Swap& swap : compiled.stencil.find_program(compiled.step_name())->swaps) {
    if (!is_set_by_steps(session.problem(), swap.state)) continue;
    fields.push_back(swap.next);
    states.push_back(session.rollout().state_index(swap.state));
  }
  if (fields.empty()) return;
  const auto found = after_step_of_no_length(session, fields);
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto values = found.find(fields[i]);
    if (states[i] < 0 || values == found.end()) continue;
    given_.push_back({states[i], session.initial(states[i])});
    session.rollout().initial(states[i]).copy_in(values->second);
  }
}

ConsistentStart::~ConsistentStart() {
  for (const Given& given : given_) session_.rollout().initial(given.state).copy_in(given.values);
}

}  // namespace dpde::stability
