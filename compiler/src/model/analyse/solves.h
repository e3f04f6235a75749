// SPDX-License-Identifier: Apache-2.0
// The equations that a problem solves in its steps and for what is observed.
#pragma once

#include <vector>

#include "model/model.h"

namespace dpde::model {

/// Each once, those that another needs before it. They live as long as the problem.
std::vector<const Solve*> solves_of(const Problem& problem);

/// Whether derivatives by Fourier series are in its operator.
bool holds_waves(const Solve& solve, const Scheme& scheme);
/// Whether it is solved wave by wave: the operator is made of the unknown and such derivatives of it alone, with
/// coefficients that are the same everywhere. Derivatives of odd orders come in pairs, as in div(grad(p)).
bool is_of_waves(const Solve& solve, const Scheme& scheme);
/// Whether derivatives of odd orders are among them. Those of a constraint are taken one by one, and each makes 0 of a
/// wave of two cells, whose slope has no sign. In an equation the operator of a pair would be another than that of the
/// derivative of second order.
bool holds_odd_orders(const Solve& solve);

/// Multigrid and Krylov methods; not so automatic.
bool is_iterative(SolveMethod method);
/// Whether solves of a step begin with what is known from before: a scheme says so, or names a method by steps; others
/// begin with nothing. Where the method is left open masks leave no other ones for large grids (transforms need
/// mirrors).
bool uses_warm_start(const Problem& problem);

/// Whether each of them makes a constraint true: then what it gives of a state that fulfils that is 0.
bool are_constraints(const Problem& problem);

}  // namespace dpde::model
