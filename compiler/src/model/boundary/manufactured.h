// SPDX-License-Identifier: Apache-2.0
// Manufactured solutions: each equation dt(u) = f(u) becomes dt(u) = f(u) + dt(U) - f(U), with a chosen smooth U put
// into f analytically (P. J. Roache, Code verification by the method of manufactured solutions, J. Fluids Eng. 124
// (2002)).
#pragma once

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::model {

/// The scene then starts from U, has U as its exact solution, and source terms in its equations. U of state i is
///   1 + i/10 + 1/5 sum over axes of sin(2 pi ((x - low)/length - t/T) + i + axis),
/// T being the length of the run. Returns false, after a diagnostic, if the problem is not only periodic differential
/// equations: with walls, events, controls, constraints, networks, solves, means, values of files or neighbours.
bool manufacture(Problem& problem, DiagnosticSink& sink);

}  // namespace dpde::model
