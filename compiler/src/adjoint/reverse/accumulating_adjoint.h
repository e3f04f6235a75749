// SPDX-License-Identifier: Apache-2.0
// Gradients by fields are summed over the steps of a run. If the adjoint of a step only stores its contribution, it can
// add it to the total directly. This saves the passes over memory that store and add the contribution.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::adjoint {

/// Adds the kernel; appends `suffix` to its name until the name is free. Returns the name.
std::string add_kernel(stencil::Module& module, stencil::Kernel kernel, const std::string& suffix);

/// Adds the accumulating adjoint: a copy of `program` that adds to those of `results` which `program` stores once and
/// then at most adds to; they become inputs. Other results do not change. Returns the copy's name; nullopt, and adds
/// nothing, if there is no such result.
std::optional<std::string> add_accumulating(const std::string& program, const std::vector<std::string>& results,
                                            stencil::Module& module);
/// Changes the program itself in the same way.
void accumulate(const std::string& program, const std::vector<std::string>& results, stencil::Module& module);

}  // namespace dpde::adjoint
