// SPDX-License-Identifier: Apache-2.0
// Solvers of one program, and what its solves have met. Solves with the same matrix, as those of the stages of a time
// scheme, share one solver.
#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "dpde/runtime/solve_note.h"
#include "solve/linear_solver.h"

namespace dpde {

class SolverShelf {
 public:
  /// \throws dpde::Error as LinearSolver does.
  std::shared_ptr<LinearSolver> solver_of(const StencilMatrix& matrix, const SolveOptions& options);
  /// Of a solve of the program: it stays where it is.
  SolveNote& add_note(std::string unknown) { return notes_.emplace_back(SolveNote{std::move(unknown)}); }
  std::deque<SolveNote>& notes() { return notes_; }

 private:
  struct Kept {
    StencilMatrix matrix;
    SolveOptions options;
    std::weak_ptr<LinearSolver> solver;
  };
  std::vector<Kept> kept_;
  std::deque<SolveNote> notes_;
};

}  // namespace dpde
