// SPDX-License-Identifier: Apache-2.0
// Recomputes the intermediate fields of a step that the reverse part reads, from the state at the start of the step.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"

namespace dpde::adjoint {

/// The states that each repeat saves for the reverse part, by the repeat's index in the program.
using Saves = std::map<std::size_t, std::vector<stencil::TapeEntry>>;

/// The statements of `program` that compute the fields `needed` and save the states `saves`; adds their kernels to
/// `kernels`.
std::vector<stencil::Statement> recomputation(const stencil::Module& module, const stencil::Program& program,
                                              std::set<std::string> needed, const Saves& saves,
                                              stencil::Module& kernels);

/// Whether a statement after `index` adds to the field.
bool is_updated_behind(const stencil::Module& module, const stencil::Program& program, const std::string& field,
                       int index);

/// Reports fields that are read and changed later: recomputation gives only their final values. `needed` has for each
/// field the earliest statement whose adjoint reads it.
bool check_overwritten(const stencil::Module& module, const stencil::Program& program,
                       const std::map<std::string, int>& needed, DiagnosticSink& sink);

}  // namespace dpde::adjoint
