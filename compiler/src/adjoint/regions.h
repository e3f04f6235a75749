// SPDX-License-Identifier: Apache-2.0
// How far beyond the interior fields are read, written and known: what the adjoint has to know of walls.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "adjoint/rules.h"
#include "stencil/build.h"

namespace dpde::adjoint {

bool has_bounded_axis(const std::vector<Topology>& axes);

/// How far beyond the interior the adjoint kernels must reach along bounded axes: as far as varied reads do, and scatters
/// to varied fields (their transposes read the first halo cell).
int reach(const stencil::Module& module, const stencil::Program& program, const Varied& varied);

/// True if `kernel` reads `field` at an offset along a periodic axis. Interpolation wraps by itself.
bool reads_around(const stencil::Kernel& kernel, const std::string& field, const std::vector<Topology>& axes);

/// How far outside a kernel that runs `grow` cells beyond the interior uses what it reads of `field`. Behind inside[o] grow g
/// the point i has i+o at most g outside, so that a read of i+k lies at most g + |k-o| outside.
int extent_of(const stencil::Kernel& kernel, const std::string& field, int grow, const std::vector<Topology>& axes);

/// Fields whose periodic halo is right when the program has run.
std::set<std::string> filled_at_the_end(const stencil::Module& module, const stencil::Program& program);

/// Fields computed beyond the interior.
std::set<std::string> grown_fields(const stencil::Module& module, const stencil::Program& program);

}  // namespace dpde::adjoint
