// SPDX-License-Identifier: Apache-2.0
// Values that a kernel needs at many displacements, such as the operands of nested differences: each level of nesting
// multiplies the size of the expression by the width of a difference. If such a value is stored in a field once and
// read there (Devito: cross-iteration redundancy elimination), the size grows with the sum of the widths only.
#pragma once

#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

struct StoredValues {
  std::vector<Kernel> before;  // without names, in order: each stores one field
  Kernel kernel;               // reads these fields
};

/// Stores displaced values of a stage's own kernel; kernels of solves are not changed. Does so only if that at least
/// halves the cost of a point, in loads, operations and fields that pass through memory; otherwise returns the kernel
/// unchanged. Operands of decisions stay as written (stencil/space/comparisons.h). New fields get names that no field
/// of the kernel has.
///
/// If all axes have the same topology, a value is stored for all its displacements: periodic axes are filled, and along
/// bounded axes its kernel runs as far out as the value is read. With both topologies only displacements along periodic
/// axes are shared: a periodic fill overwrites the values of a field beyond walls.
StoredValues with_stored_values(const Kernel& kernel, const std::vector<Topology>& axes);

/// The module with stored values substituted where they are read. Analyses of the reads of a step, or of frozen
/// coefficients, need it: only the formula of a stored value shows what varies from cell to cell.
Module with_values_in_place(const Module& module);

}  // namespace dpde::stencil
