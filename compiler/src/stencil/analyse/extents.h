// SPDX-License-Identifier: Apache-2.0
// Distances beyond the interior at which kernels read fields.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// For each field the largest distance beyond bounded axes at which a kernel run with `grow` uses its values. Under the
/// condition inside[o] grow g, i+o is at most g outside, so that a read of i+k is at most g + |k-o| outside.
/// Lets count under the conditions of their uses: values that no use takes may come from cells that are never set.
std::map<std::string, int> extents_of(const Kernel& kernel, int grow, const std::vector<Topology>& axes);

/// The fields that a kernel reads at an offset along a periodic axis. Interpolations are excluded, as they wrap.
std::set<std::string> read_around(const Kernel& kernel, const std::vector<Topology>& axes);

/// The fields whose halo a kernel reads, along any axis. Interpolation reads its first cell.
std::set<std::string> read_beyond(const Kernel& kernel, int grow, const std::vector<Topology>& axes);

}  // namespace dpde::stencil
