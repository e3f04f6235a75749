// SPDX-License-Identifier: Apache-2.0
// What the solves of a run have met, at the equations that a person wrote.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "dpde/runtime/solve_note.h"
#include "driver/scene/session.h"

namespace dpde::driver {

struct SolveReport {
  std::string field;  // as it is written
  SourceRange range;
  std::string guess;                // fields with which a method by steps begins; "": with 0
  SolveNote note;                   // of all solves of steps that come from this equation
  bool is_guess_asked_for = false;  // by guess = last
  bool is_adjoint = false;
};
/// Where the solve for a field was written, or a quotient or choice that is watched; unknown where there is none.
SourceRange place_of_solve(const Compiled& compiled, const std::string& unknown);
/// Of steps that were made; equations that were not solved are left out.
std::vector<SolveReport> solves_of(const Compiled& compiled, const std::deque<SolveNote>& notes);
/// Of the way back: transposed solves, "the adjoint of psi".
std::vector<SolveReport> adjoint_solves_of(const Compiled& compiled, const std::deque<SolveNote>& notes);
/// Warnings of right sides that the operator does not reach, and of solves that did not come to their tolerance.
void report_solves(const model::Problem& problem, const std::vector<SolveReport>& solves, DiagnosticSink& sink);
/// "solve for p: fourier (why)", a line each.
std::string text_of(const std::vector<SolveReport>& solves);

}  // namespace dpde::driver
