// SPDX-License-Identifier: Apache-2.0
// Results of a run's solves, reported at the equations in the text.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "dpde/runtime/solve_note.h"
#include "driver/scene/session.h"

namespace dpde::driver {

struct SolveReport {
  std::string field;  // as in the text
  SourceRange range;
  std::string guess;                // fields from which an iterative method starts; "": 0
  SolveNote note;                   // over all solves of the equation
  bool is_guess_asked_for = false;  // by guess = last
  bool is_adjoint = false;
};
/// Source range of the solve for a field, or of a watched quotient or choice; unknown if there is none.
SourceRange place_of_solve(const Compiled& compiled, const std::string& unknown);
/// For forward steps; equations that were not solved are omitted.
std::vector<SolveReport> solves_of(const Compiled& compiled, const std::deque<SolveNote>& notes);
/// For the reverse sweep: transposed solves, "the adjoint of psi".
std::vector<SolveReport> adjoint_solves_of(const Compiled& compiled, const std::deque<SolveNote>& notes);
/// Warns of right-hand sides outside the range of the operator, and of solves that did not reach their tolerance.
void report_solves(const model::Problem& problem, const std::vector<SolveReport>& solves, DiagnosticSink& sink);
/// "solve for p: fourier (why)", one line for each.
enum class SolveTimes { shown, left_out };
std::string text_of(const std::vector<SolveReport>& solves, SolveTimes times = SolveTimes::shown);
/// The times alone, in indented lines.
std::string times_text(const std::vector<SolveReport>& solves);

}  // namespace dpde::driver
