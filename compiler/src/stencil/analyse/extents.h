// SPDX-License-Identifier: Apache-2.0
// How far kernels read beyond the cells of a program.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// How far beyond bounded axes a kernel that runs `grow` cells beyond them uses what it reads of each field. Behind
/// inside[o] grow g the point i has i+o at most g outside, so that a read of i+k lies at most g + |k-o| outside.
std::map<std::string, int> extents_of(const Kernel& kernel, int grow, const std::vector<Topology>& axes);

/// The fields that a kernel reads at an offset along a periodic axis. Interpolation wraps by itself.
std::set<std::string> read_around(const Kernel& kernel, const std::vector<Topology>& axes);

/// The fields of whose halo it uses anything, along any axis. Interpolation looks at the first cell of it.
std::set<std::string> read_beyond(const Kernel& kernel, int grow, const std::vector<Topology>& axes);

}  // namespace dpde::stencil
