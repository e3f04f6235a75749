// SPDX-License-Identifier: Apache-2.0
// Gradients by fields are added up over the steps of a run. The adjoint of a step that does nothing but store its share
// may add it to the total itself: of the passes over memory that take a share there and back, none is left.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::adjoint {

/// Adds the kernel, called `suffix` once more until nothing else is called so; returns its name.
std::string add_kernel(stencil::Module& module, stencil::Kernel kernel, const std::string& suffix);

/// Adds a copy of `program` in which those of `results` that it stores to once, and then adds to, are inputs to which
/// it adds. The other results stay as they are. Returns the copy's name; nullopt, and nothing is added, if there is no
/// such result.
std::optional<std::string> add_accumulating(const std::string& program, const std::vector<std::string>& results,
                                            stencil::Module& module);
/// The same for the program itself.
void accumulate(const std::string& program, const std::vector<std::string>& results, stencil::Module& module);

}  // namespace dpde::adjoint
