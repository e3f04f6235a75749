// SPDX-License-Identifier: Apache-2.0
// A stage of an implicit scheme that is solved by Newton's method, for all fields together:
//   X - factor*f(X) = R.
// A block computes the left side: it copies X to fields with the boundaries of the states, fills these and evaluates f.
// Known values on a high wall are not unknowns: there the left side is X itself.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "model/model.h"
#include "stencil/lower/lowering.h"

namespace dpde::stencil {

struct NewtonEquation {
  std::string state, right, unknown;                // its fields
  std::vector<std::pair<Expr, model::Expr>> parts;  // factors and f
  Origin origin;
};

/// `reading` names the fields that replace other states. Kernels are called NAME_trial and NAME_left.
std::vector<Stage> newton_stages(Lowering& lowering, const std::string& name,
                                 const std::vector<NewtonEquation>& equations, Environment reading);

}  // namespace dpde::stencil
