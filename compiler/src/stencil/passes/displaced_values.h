// SPDX-License-Identifier: Apache-2.0
// Values that a kernel needs at many displacements, as those that a difference of a difference takes: each level of
// nesting multiplies the text by the width of a difference. Stored in a field once, such a value is read there (Devito:
// cross-iteration redundancy elimination): the text grows with the sum of the widths.
#pragma once

#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

struct StoredValues {
  std::vector<Kernel> before;  // without names, in order: each stores one field
  Kernel kernel;               // which reads these fields
};

/// Of a stage's own kernel; what is solved for keeps its text. Where that at least halves what a point takes, in loads,
/// operations and fields that pass through memory; else the kernel as it is. What a decision hangs on stays as it is
/// written (stencil/space/comparisons.h). Fields get names that no field of the kernel has.
///
/// Where all axes are alike a value is stored for all of its displacements: along rings fills go around, beyond walls
/// its kernel runs as far out as it is read. Beside rings it keeps its displacements along walls: a fill around a ring
/// leaves nothing of what a field holds beyond walls.
StoredValues with_stored_values(const Kernel& kernel, const std::vector<Topology>& axes);

/// The module with these values back in the places where they are read, for who asks what a step reads of its states,
/// or freezes them at a place: what varies from cell to cell within a stored value is seen in its formula alone.
Module with_values_in_place(const Module& module);

}  // namespace dpde::stencil
