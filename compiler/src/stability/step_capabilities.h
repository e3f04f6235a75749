// SPDX-License-Identifier: Apache-2.0
// Features of a program that decide whether and how it is linearised.
#pragma once

#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stability {

struct StepCapabilities {
  std::string why;  // the reason why there is no linear step; "": there is one
  bool is_semi_lagrangian = false, reduces = false, solves = false, has_networks = false;
};
void survey(const stencil::Module& module, const std::vector<stencil::Statement>& body, StepCapabilities& result);
/// The module with 0 as the initial guess of all solves: the guess does not affect the linear step.
stencil::Module without_guesses(stencil::Module module);

}  // namespace dpde::stability
