// SPDX-License-Identifier: Apache-2.0
// How far beyond the interior fields are read, written and known: what the adjoint has to know of walls.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "adjoint/rules.h"
#include "stencil/build.h"

namespace dpde::adjoint {

bool has_bounded_axis(const std::vector<Topology>& axes);

/// How far beyond the interior the adjoint kernels must reach along bounded axes: as far as varied reads do, and
/// scatters to varied fields (their transposes read the first halo cell).
int reach(const stencil::Module& module, const stencil::Program& program, const Varied& varied);

/// The fill behind which no field is changed any more: so fields go on when the program has run, where no block has
/// left their halo as anything.
std::map<std::string, const stencil::Fill*> fills_at_the_end(const stencil::Module& module,
                                                             const stencil::Program& program);

/// The fields that the program reads, sets on walls or scatters to.
std::set<std::string> fields_read_inside(const stencil::Module& module, const stencil::Program& program);

/// Whether one of the statements uses the values of a field; that a fill sets its halo does not count.
bool is_read_by(const stencil::Module& kernels, const std::vector<stencil::Statement>& body, const std::string& field);

/// Of fields that only the adjoint reads beside periodic axes: seeds, and primal fields that the program does not fill.
/// What is read beyond walls is masked by inside[...], so the kind of bounded sides is never seen.
std::vector<stencil::AxisBoundary> boundary_around(const std::vector<Topology>& axes);

/// Fields computed beyond the interior.
std::set<std::string> grown_fields(const stencil::Module& module, const stencil::Program& program);

}  // namespace dpde::adjoint
