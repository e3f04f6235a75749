// SPDX-License-Identifier: Apache-2.0
// Distances beyond the interior at which fields are read, written and known, for adjoints at walls.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "adjoint/rules.h"
#include "stencil/build.h"

namespace dpde::adjoint {

bool has_bounded_axis(const std::vector<Topology>& axes);

/// Distance beyond the interior at which adjoint kernels run along bounded axes: as far as varied reads and scatters to
/// varied fields reach (transposes of scatters read the first halo cell).
int reach(const stencil::Module& module, const stencil::Program& program, const Varied& varied);

/// The last fill of each field after which the field does not change: it describes the halo at the end of the program,
/// unless a block has left that undefined.
std::map<std::string, const stencil::Fill*> fills_at_the_end(const stencil::Module& module,
                                                             const stencil::Program& program);

/// The fields that the program reads, sets on walls or scatters to.
std::set<std::string> fields_read_inside(const stencil::Module& module, const stencil::Program& program);

/// Whether one of the statements uses the values of a field; a fill of the field does not count.
bool is_read_by(const stencil::Module& kernels, const std::vector<stencil::Statement>& body, const std::string& field);

/// Boundary for neighbours along periodic axes of fields that only the adjoint reads: seeds, and primal fields that the
/// program does not fill. Reads beyond walls are masked by inside[...], so conditions of bounded sides do not matter.
std::vector<stencil::AxisBoundary> boundary_around(const std::vector<Topology>& axes);

/// Fields computed beyond the interior.
std::set<std::string> grown_fields(const stencil::Module& module, const stencil::Program& program);

}  // namespace dpde::adjoint
