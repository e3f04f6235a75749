// SPDX-License-Identifier: Apache-2.0
// What a statement does to fields and numbers. Analyses ask here, or match() over all kinds of statement, so that a new
// kind does not compile before each of them knows it; who looks for what one kind has asks support/walk.h. tests/house
// refuses anything else that looks for one kind alone.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// Names in the order in which they first appear, each once.
struct Effects {
  std::vector<std::string> reads;    // fields whose values it uses
  std::vector<std::string> writes;   // fields that have other values afterwards, whatever they had before
  std::vector<std::string> updates;  // fields to whose values it adds
  std::vector<std::string> fills;    // fields whose halo it fills, and where they lie on walls the values there
  std::vector<std::string> params;   // of kernels and of boundary values
  std::vector<std::string> sums;
  std::vector<std::string> kernels, networks;  // that it runs and applies
  std::vector<std::string> block_locals;       // fields of a block, which nothing outside knows
  std::vector<std::string> invalidates_halo;   // fields whose halo is anything afterwards
};
Effects effects(const Module& module, const Statement& statement);

/// One pass of a repeat as a program of its own, with what it loads as inputs.
Program pass_of(const Repeat& repeat, const Program& program);
/// The block of a solve as a program of its own, which keeps the images; the unknowns are inputs of it.
Program operator_of(const Solve& solve, const Program& program);
/// What the operator reads beside the unknowns.
std::vector<std::string> coefficients_of(const Module& module, const Solve& solve);
/// What its preconditioner is given beside what an iteration leaves.
std::vector<std::string> fields_beside_residual(const Solve& solve);

/// The numbers of passes in the statements, those of blocks too, in the order in which they appear.
std::vector<std::string> counters_of(const std::vector<Statement>& statements);

/// That the run runs, which is in the module.
const Kernel& kernel_of(const Module& module, const Run& run);
/// The kernels that the program runs, each once, in order.
std::vector<const Kernel*> kernels_run(const Module& module, const Program& program);

/// The statements but for fills, those in blocks too.
std::vector<Statement> without_fills(std::vector<Statement> statements);
/// Solves that begin with 0 and have no preconditioner come to the same: without what only those are made of.
void forget_guesses(std::vector<Statement>& statements);

/// The names of the kernels and networks that the programs need, networks in the order in which they first appear.
struct Parts {
  std::set<std::string> kernels;
  std::vector<std::string> networks;
};
Parts parts_of(const std::vector<Program>& programs);

}  // namespace dpde::stencil
