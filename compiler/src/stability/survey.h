// SPDX-License-Identifier: Apache-2.0
// What a linear step has to know of a program before it is made.
#pragma once

#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stability {

struct Survey {
  std::string why;  // what it cannot hold, or ""
  bool follows_flow = false, reduces = false, solves = false, has_networks = false;
};
void survey(const stencil::Module& module, const std::vector<stencil::Statement>& body, Survey& result);

}  // namespace dpde::stability
