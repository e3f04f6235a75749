// SPDX-License-Identifier: Apache-2.0
// Constraints of a step: after each stage a projection changes the states so that the constraints hold.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stencil/lower/lowering.h"

namespace dpde::stencil {

/// Fields into which a stage stores: an additional field for states that constraints change, else that of `into`.
/// `is_last`: the stage is the last one of the step.
FieldsOfStates before_projection(Lowering& lowering, const FieldsOfStates& into, bool is_last = true);

struct ProjectedStage {
  std::string name;
  FieldsOfStates from, into;  // the result of before_projection; the fields of the projected states
  Expr time, length, step;    // time of the results; length of the stage; length of the whole step
  bool is_last = true;        // as in before_projection
};
/// Stages that project the results of `stage` onto the constraints of the states in `into`. Values that constraints
/// determine are stored in the fields that `into` names for them.
std::vector<Stage> projection_stages(Lowering& lowering, const ProjectedStage& stage);

}  // namespace dpde::stencil
