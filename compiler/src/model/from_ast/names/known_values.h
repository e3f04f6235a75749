// SPDX-License-Identifier: Apache-2.0
// Values of formulas of numbers, parameters and t that are known before the run, for checks only: a host program may
// set others. Values used at compile time come from made_once.
#pragma once

#include <optional>
#include <vector>

#include "model/boundary/wall_image.h"
#include "model/from_ast/elaboration.h"

namespace dpde::model {

/// nullopt if a parameter has no value or the result is not finite.
std::optional<double> known_value(const Expr& e, const KnownValues& values);
/// The formula with known parameters replaced by their values.
Expr with_known(const Expr& e, const KnownValues& values);
bool holds_time(const Expr& e);
/// The begin and middle of the steps, where schemes evaluate; of very many steps a selection.
std::vector<double> times_of_run(const Problem& problem);
/// The scene's values, with initial values of the task's parameters. Requires a task.
KnownValues values_at_start(const Elaboration& elaboration);

}  // namespace dpde::model
