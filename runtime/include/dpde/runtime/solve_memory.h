// SPDX-License-Identifier: Apache-2.0
// How much memory a linear solve takes for the values of one field, before it is made.
#pragma once

#include <array>
#include <cstdint>

#include "dpde/kernel_abi.h"

namespace dpde {

struct SolveShape {
  std::array<std::int64_t, 3> cells{1, 1, 1};
  std::array<bool, 3> periodic{};
  std::array<std::int64_t, 3> reach{};  // of an image from its cell; -1: as far as the axis goes
  bool is_constant = true;              // the same row in all cells, with walls that are mirrors
  int method = DPDE_SOLVE_AUTOMATIC;    // of dpde_solve
  int guesses = 0;
  bool has_floats = false;  // transforms of fields of f32
  bool changes = false;     // coefficients, from step to step
};

/// Of a solve without coefficients rows are taken to be the same in all cells.
SolveShape shape_of(const dpde_solve& solve, const dpde_layout& layout);
/// Whether steps make another field of one of its coefficients.
bool has_changing_coefficients(const dpde_solve& solve, const dpde_program& program);

struct SolveMemory {
  double kept = 0;  // bytes, as long as the solve is there
  double peak = 0;  // bytes while its solver is made, those that are kept included
};

/// Stencils are taken to be stars. Of factors, complete or not, it is an estimate: what they fill in is not known.
SolveMemory memory_of(const SolveShape& shape);

}  // namespace dpde
