// SPDX-License-Identifier: Apache-2.0
// A smooth solution that is made up, and the source terms that make it one: each equation dt(u) = f(u) becomes
// dt(u) = f(u) + dt(U) - f(U), in which U is put into f by the rules of calculus (P. J. Roache, Code verification by
// the method of manufactured solutions, J. Fluids Eng. 124 (2002)).
#pragma once

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::model {

/// The scene begins with U, has it as its exact solution, and equations with sources. U of the state i is
///   1 + i/10 + 1/5 sum over axes of sin(2 pi ((x - low)/length - t/T) + i + axis),
/// T being the length of the run. False, after a diagnostic, where that is no solution on rings alone: walls, events,
/// controls, constraints, networks, solves, means, values of files and neighbours.
bool manufacture(Problem& problem, DiagnosticSink& sink);

}  // namespace dpde::model
