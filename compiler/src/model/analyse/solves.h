// SPDX-License-Identifier: Apache-2.0
// The equations that a problem solves in its steps and for its results.
#pragma once

#include <vector>

#include "model/model.h"

namespace dpde::model {

/// Each solve once; a solve comes after those that it contains. Pointers are valid as long as the problem.
std::vector<const Solve*> solves_of(const Problem& problem);

/// Whether its operator has derivatives by Fourier series.
bool holds_waves(const Solve& solve, const Scheme& scheme);
/// Whether it is solved mode by mode: the operator contains only the unknown and its Fourier derivatives, with uniform
/// coefficients. Odd orders must be nested in pairs, as in div(grad(p)).
bool is_of_waves(const Solve& solve, const Scheme& scheme);
/// Whether the operator has derivatives of odd orders. A constraint takes the two derivatives of a pair one after the
/// other, and each gives 0 for the wave of two cells, whose slope has no sign. In an equation the operator of a pair
/// would then differ from the second derivative.
bool holds_odd_orders(const Solve& solve);

/// Multigrid and Krylov methods; false for automatic.
bool is_iterative(SolveMethod method);
/// Whether solves of a step start from the stored solution of earlier steps: if the scheme says so or names an
/// iterative method. With an automatic method masks do so too, as they leave only iterative methods for large grids
/// (transforms need mirror symmetry).
bool uses_warm_start(const Problem& problem);

/// Whether every solve enforces a constraint. Then a state that fulfils the constraint gives the solution 0.
bool are_constraints(const Problem& problem);

}  // namespace dpde::model
