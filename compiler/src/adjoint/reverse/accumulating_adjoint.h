// SPDX-License-Identifier: Apache-2.0
// Gradients by fields are added up over the steps of a run. The adjoint of a step that does nothing but store its share
// may add it to the total itself: of the passes over memory that take a share there and back, none is left.
#pragma once

#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::adjoint {

/// Adds the kernel, called `suffix` once more until nothing else is called so; returns its name.
std::string add_kernel(stencil::Module& module, stencil::Kernel kernel, const std::string& suffix);

/// The results of a program that may be totals. No program: there are none.
struct AccumulatingAdjoint {
  std::string program;
  std::vector<std::string> results;
  std::string name() const { return program + "_total"; }
};

/// Adds the program totals.name() to the module: the program with those of the results that it stores to once, and then
/// adds to, as inputs that it adds to. False, and nothing is added, where that is so of none. The other results stay
/// what they are.
bool add_program_of(const AccumulatingAdjoint& totals, stencil::Module& module);
/// The same of the program itself, of which there is no other use.
void make_totals(const AccumulatingAdjoint& totals, stencil::Module& module);

}  // namespace dpde::adjoint
