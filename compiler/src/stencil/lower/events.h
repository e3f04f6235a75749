// SPDX-License-Identifier: Apache-2.0
// Events (after step, every, at) as part of the step: behind its last stage, chosen by the number of the step, which t
// tells. So they are differentiated, stored and compiled like everything else, and cost nothing where they fit into the
// last kernel.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "stencil/lower/lowering.h"

namespace dpde::stencil {

/// Makes what is done before an event: of its place among the problem's events, and what it reads.
using BeforeEvent = std::function<std::optional<Stage>(std::size_t event, const Environment& reading)>;

/// `ends`: the fields that hold the states when the stages are done; afterwards those behind the events. With `before`
/// each event has a stage of its own.
void add_events(Lowering& lowering, std::vector<Stage>& stages, std::map<std::string, std::string>& ends,
                const BeforeEvent& before = {});

/// When the event happens, at the end of a step; nullopt: of each one.
std::optional<Expr> condition_of(const model::Event& event, const model::Problem& problem, Discretiser& at_point);

}  // namespace dpde::stencil
