// SPDX-License-Identifier: Apache-2.0
// Intermediate fields of a step are computed again from its first state where the reverse part reads them.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "stencil/stencil.h"

namespace dpde::adjoint {

/// Which states each repeat saves for what comes later, by its index in the program.
using Saves = std::map<std::size_t, std::vector<stencil::TapeEntry>>;

/// The statements of `program` that compute the fields `needed` and save what is to be saved; their kernels are added
/// to `kernels`.
std::vector<stencil::Statement> recomputation(const stencil::Module& module, const stencil::Program& program,
                                              std::set<std::string> needed, const Saves& saves,
                                              stencil::Module& kernels);

/// Whether a statement behind `index` adds to the field.
bool is_updated_behind(const stencil::Module& module, const stencil::Program& program, const std::string& field,
                       int index);

/// Values are recomputed to their final state: a field that is read and changed later would be read wrongly. Reports
/// it; `needed` has for each field the earliest statement whose adjoint reads it.
bool check_overwritten(const stencil::Module& module, const stencil::Program& program,
                       const std::map<std::string, int>& needed, DiagnosticSink& sink);

}  // namespace dpde::adjoint
