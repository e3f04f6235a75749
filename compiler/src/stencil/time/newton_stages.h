// SPDX-License-Identifier: Apache-2.0
// A stage of an implicit scheme that is solved by Newton's method, all fields at once:
//   X - factor*f(X) = R.
// A block makes the left side: it copies X to fields with the boundaries of the states, fills these and takes f of
// them. What lies on a high wall is no unknown: there the left side is X itself.
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

/// `reading` knows the fields that stand for other states. Kernels are called NAME_trial and NAME_left.
std::vector<Stage> newton_stages(Lowering& lowering, const std::string& name,
                                 const std::vector<NewtonEquation>& equations, Environment reading);

}  // namespace dpde::stencil
