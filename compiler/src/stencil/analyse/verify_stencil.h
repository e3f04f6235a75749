// SPDX-License-Identifier: Apache-2.0
// Checks of the invariants of every stencil module. They find bugs of the compiler: from_ast has reported errors of the
// user before.
#pragma once

#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// A broken invariant and its location.
struct Violation {
  std::string text;
  std::string declaration;  // the kernel or program; "" for the module
  int statement = -1;       // of a program's body; -1 for the whole
};
std::vector<Violation> find_violations(const Module& module);

/// One sentence for each broken invariant of `module`; empty if all hold.
std::vector<std::string> verify(const Module& module);

}  // namespace dpde::stencil
