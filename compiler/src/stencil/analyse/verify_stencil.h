// SPDX-License-Identifier: Apache-2.0
// Checks of what every stencil module must satisfy. For bugs of the compiler: what a user can write wrongly is reported
// by from_ast before.
#pragma once

#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// One thing that is wrong, and where.
struct Violation {
  std::string text;
  std::string declaration;  // the kernel or program; "" for the module
  int statement = -1;       // of a program's body; -1 for the whole
};
std::vector<Violation> find_violations(const Module& module);

/// Everything wrong with `module`, one sentence each; empty when all holds.
std::vector<std::string> verify(const Module& module);

}  // namespace dpde::stencil
