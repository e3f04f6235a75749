// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen/consistent_start.h"

#include <algorithm>

#include "stability/equations.h"
#include "stability/frozen/zero_step.h"

namespace dpde::stability {

namespace {

/// `values` plus the change that the step makes in the coarse grid's cell means.
std::vector<double> corrected(std::vector<double> values, std::vector<double> means, const CoarseGrid& grid,
                              const model::Placement& placement) {
  const std::vector<double> before = grid.restricted(values, placement);
  for (std::size_t i = 0; i < means.size(); ++i) means[i] -= before[i];
  const std::vector<double> change = grid.prolonged(means, placement);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += change[i];
  return values;
}

}  // namespace

bool is_set_by_steps(const model::Problem& problem, const std::string& state) {
  return problem.is_projected(state) || std::ranges::any_of(problem.events, [&](const model::Event& event) {
           return is_of_each_step(event, problem) &&
                  std::ranges::find(event.updates, state, &model::Event::Update::state) != event.updates.end();
         });
}

ConsistentStart::ConsistentStart(driver::Session& session) : ConsistentStart(session, session.problem().t_begin) {}

/// Several passes: prescribed values depend on the results of events, which the first pass has not seen yet, and on
/// other prescribed values of the stage before.
ConsistentStart::ConsistentStart(driver::Session& session, double t) : session_(session) {
  const driver::Compiled& compiled = session.compiled();
  std::vector<std::pair<int, std::string>> set, held;
  for (const stencil::Swap& swap : compiled.stencil.find_program(compiled.step_name())->swaps) {
    const int state = session.rollout().state_index(swap.state);
    if (state < 0 || !is_set_by_steps(session.problem(), swap.state)) continue;
    set.emplace_back(state, swap.next);
    if (session.problem().is_projected(swap.state)) held.emplace_back(state, swap.next);
    given_.push_back({state, session.initial(state)});
  }
  if (!take(set, t)) return;
  // One pass for the results of events, and one for each prescribed value that another one reads.
  for (std::size_t pass = held.size() < set.size() ? 0 : 1; pass <= held.size() && take(held, t); ++pass) {
  }
}

bool ConsistentStart::take(const std::vector<std::pair<int, std::string>>& set, double t) {
  if (set.empty()) return false;
  std::vector<std::string> fields;
  for (const auto& [state, next] : set) fields.push_back(next);
  const bool has_events = has_events_in_each_step(session_.problem());
  const CoarseGrid grid = has_events ? CoarseGrid::own(session_.axes()) : grid_of_solutions(session_);
  const auto found = after_step_of_no_length(session_, fields, t, grid);
  bool is_other = false;
  for (const auto& [state, next] : set) {
    const auto values = found.find(next);
    if (values == found.end()) continue;
    const std::vector<double> before = session_.initial(state);
    const model::Placement& placement = session_.problem().find_state(session_.rollout().state_name(state))->placement;
    const std::vector<double> behind =
        grid.is_own() ? values->second : corrected(before, values->second, grid, placement);
    if (behind == before) continue;
    session_.rollout().initial(state).copy_in(behind);
    is_other = true;
  }
  return is_other && grid.is_own();  // on coarse grids only constraints act, whose results no other state reads
}

ConsistentStart::~ConsistentStart() {
  for (const Given& given : given_) session_.rollout().initial(given.state).copy_in(given.values);
}

}  // namespace dpde::stability
