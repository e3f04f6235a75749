// SPDX-License-Identifier: Apache-2.0
// Effects of a statement on fields and numbers. Analyses use these effects, or match() over all kinds of statement, so
// that a new kind compiles only once every analysis handles it. Code that searches for one kind uses support/walk.h.
// tests/house rejects other code that tests for a single kind.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Names in the order in which they first appear, each once.
struct Effects {
  std::vector<std::string> reads;    // fields whose values it uses
  std::vector<std::string> writes;   // fields that it overwrites
  std::vector<std::string> updates;  // fields to whose values it adds
  std::vector<std::string> fills;    // fields whose halo it fills, and their values on walls
  std::vector<std::string> params;   // of kernels and of boundary values
  std::vector<std::string> sums;
  std::vector<std::string> kernels, networks;  // that it runs and applies
  std::vector<std::string> block_locals;       // fields local to a block
  std::vector<std::string> invalidates_halo;   // fields whose halo is undefined afterwards
};
Effects effects(const Module& module, const Statement& statement);

/// One pass of a repeat as a program of its own, with its loaded fields as inputs.
Program pass_of(const Repeat& repeat, const Program& program);
/// The block of a solve as a program of its own: inputs are the unknowns, results the images.
Program operator_of(const Solve& solve, const Program& program);
/// Fields that the operator reads in addition to the unknowns.
std::vector<std::string> coefficients_of(const Module& module, const Solve& solve);
/// Inputs of the preconditioner in addition to the residual.
std::vector<std::string> fields_beside_residual(const Solve& solve);

/// Names of all counters in the statements and their blocks, in order of appearance.
std::vector<std::string> counters_of(const std::vector<Statement>& statements);

/// The kernel of the run, which must be in the module.
const Kernel& kernel_of(const Module& module, const Run& run);
/// The kernels that the program runs, each once, in order.
std::vector<const Kernel*> kernels_run(const Module& module, const Program& program);

/// The statements without fills, in blocks too.
std::vector<Statement> without_fills(std::vector<Statement> statements);
/// Removes guesses and preconditioners of solves, which do not change the solution, and the statements that only they
/// need.
void forget_guesses(std::vector<Statement>& statements);

/// Names of the kernels and networks that the programs need, networks in order of first appearance.
struct Parts {
  std::set<std::string> kernels;
  std::vector<std::string> networks;
};
Parts parts_of(const std::vector<Program>& programs);

}  // namespace dpde::stencil
