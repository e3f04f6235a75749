// SPDX-License-Identifier: Apache-2.0
// What a linear step has to know of a program before it is made.
#pragma once

#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stability {

struct StepCapabilities {
  std::string why;  // what it cannot hold, or ""
  bool is_semi_lagrangian = false, reduces = false, solves = false, has_networks = false;
};
void survey(const stencil::Module& module, const std::vector<stencil::Statement>& body, StepCapabilities& result);
/// The same with solves that begin with 0: what they begin with has no part in what a step does.
stencil::Module without_guesses(stencil::Module module);

}  // namespace dpde::stability
