// SPDX-License-Identifier: Apache-2.0
// What the adjoint of a step reads of a state may be a few values that the step makes anyway. The gradient of a wave by
// c in dt(dt(u)) = c*lap(u) reads u at every point of lap, and nothing of it but lap(u). Where the step keeps these
// values, one field for each state that is not read any more, the adjoint evaluates one stencil and not two, and
// as many fields are stored.
#pragma once

#include <string>

#include "stencil/stencil.h"

namespace dpde::adjoint {

/// A step and its adjoint, and what the programs are called that write and read what is kept.
struct Kept {
  std::string step, adjoint;
  std::string step_name() const { return step + "_keeping"; }
  std::string adjoint_name() const { return adjoint + "_of_kept"; }
};

/// Adds both programs to the module: the step with stores of what is kept, and the adjoint with these fields as inputs
/// in place of states. They have the same names in both. False, and nothing is added, where that spares less than a
/// stencil of 13 points, or the step does not make these values anyway.
bool add_kept_programs(const Kept& kept, stencil::Module& module);

}  // namespace dpde::adjoint
