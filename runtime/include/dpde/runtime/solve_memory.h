// SPDX-License-Identifier: Apache-2.0
// Memory that a linear solve will need for the values of one field.
#pragma once

#include <array>
#include <cstdint>

#include "dpde/kernel_abi.h"

namespace dpde {

struct SolveShape {
  std::array<std::int64_t, 3> cells{1, 1, 1};
  std::array<bool, 3> periodic{};
  std::array<std::int64_t, 3> reach{};  // stencil radius; -1: the whole axis
  bool is_constant = true;              // the same matrix row in all cells, mirror boundaries
  int method = DPDE_SOLVE_AUTOMATIC;    // of dpde_solve
  int guesses = 0;
  bool has_floats = false;  // Fourier transforms in single precision
  bool changes = false;     // coefficients change from step to step
};

/// If the solve has no coefficients, its rows are taken to be the same in all cells.
SolveShape shape_of(const dpde_solve& solve, const dpde_layout& layout);
/// Whether steps change one of its coefficients.
bool has_changing_coefficients(const dpde_solve& solve, const dpde_program& program);

struct SolveMemory {
  double kept = 0;  // bytes for the lifetime of the solve
  double peak = 0;  // bytes while the solver is set up, `kept` included
};

/// Assumes star-shaped stencils. For complete and incomplete factors it is an estimate: their fill-in is not known.
SolveMemory memory_of(const SolveShape& shape);

}  // namespace dpde
