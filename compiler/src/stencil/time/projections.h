// SPDX-License-Identifier: Apache-2.0
// Constraints of a step: behind each stage the states that it leaves are changed so that they are true.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stencil/lower/lowering.h"

namespace dpde::stencil {

/// What a stage stores into: for states that constraints change a field beside them, for the others that of `into`.
/// `is_last`: the step ends with it.
FieldsOfStates before_projection(Lowering& lowering, const FieldsOfStates& into, bool is_last = true);

struct ProjectedStage {
  std::string name;
  FieldsOfStates from, into;  // of before_projection; what the results go to
  Expr time, length, step;    // of the results; over which the stage took the rates; of the whole step
  bool is_last = true;        // as of before_projection
};
/// The stages that take what one stage leaves to where the constraints are true, those whose states `into` names. What
/// constraints give is stored where it names that.
std::vector<Stage> projection_stages(Lowering& lowering, const ProjectedStage& stage);

}  // namespace dpde::stencil
