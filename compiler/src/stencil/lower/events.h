// SPDX-License-Identifier: Apache-2.0
// Events (after step, every, at) as part of the step: after its last stage, selected by the number of the step, which
// follows from t. So they are differentiated, stored and compiled like all stages, and cost no kernel of their own if
// they fit into the last one.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "stencil/lower/lowering.h"

namespace dpde::stencil {

/// Creates the stage before an event, from the event's index in the problem and the event's environment.
using BeforeEvent = std::function<std::optional<Stage>(std::size_t event, const Environment& reading)>;

/// Appends the events. `ends`: the fields that hold the states after the stages; on return those after the events. With
/// `before` each event has a stage of its own.
void add_events(Lowering& lowering, std::vector<Stage>& stages, std::map<std::string, std::string>& ends,
                const BeforeEvent& before = {});

/// Condition at the end of a step under which the event happens; nullopt: in each step.
std::optional<Expr> condition_of(const model::Event& event, const model::Problem& problem, Discretiser& at_point);

}  // namespace dpde::stencil
