// SPDX-License-Identifier: Apache-2.0
// Values that formulas of numbers, parameters and t are known to take before the run, for a look at what they do: a
// host may give others. What something is made of is evaluated elsewhere (made_once).
#pragma once

#include <optional>
#include <vector>

#include "model/boundary/wall_image.h"
#include "model/from_ast/elaboration.h"

namespace dpde::model {

/// nullopt where a parameter has no value, or the formula none that is finite.
std::optional<double> known_value(const Expr& e, const KnownValues& values);
/// The formula with these values in the place of parameters that have one.
Expr with_known(const Expr& e, const KnownValues& values);
bool holds_time(const Expr& e);
/// The beginning of the steps and their middle, where schemes look; of very many some.
std::vector<double> times_of_run(const Problem& problem);
/// The scene's values, with those that the task's parameters begin with. Not without a task.
KnownValues values_at_start(const Elaboration& elaboration);

}  // namespace dpde::model
