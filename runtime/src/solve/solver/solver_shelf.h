// SPDX-License-Identifier: Apache-2.0
// Solvers shared by programs that run one after the other, and the statistics of one program's solves. Solves with the
// same matrix, as in the stages of a time scheme and their adjoints, share one solver.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dpde/runtime/solve_note.h"
#include "dpde/runtime/team.h"
#include "solve/solver/linear_solver.h"

namespace dpde {

/// Work vectors of a solve, without state between solves: all solves of a store share them.
struct SolveVectors {
  std::vector<double> right, solution, guesses;
};

class SolverStore {
 public:
  /// Space for at least `guesses` guesses, one after the other.
  std::shared_ptr<SolveVectors> vectors(std::size_t cells, std::size_t guesses);
  /// A solver for the operator, which is compared with those of existing solvers; it lives as long as it is referenced.
  /// `spare`: from take_spare(), or null.
  /// \throws dpde::Error as LinearSolver does.
  std::shared_ptr<LinearSolver> solver_of(std::shared_ptr<const GridOperator> grid_operator,
                                          const SolveOptions& options, const Team& team,
                                          std::shared_ptr<LinearSolver> spare = nullptr);
  /// Stores a solver of these options, made by solver_of() and without other references, until another one reuses its
  /// memory.
  void give_spare(std::shared_ptr<LinearSolver> solver, const SolveOptions& options);
  /// A stored solver with these options and so many cells, or null.
  std::shared_ptr<LinearSolver> take_spare(const SolveOptions& options, const std::array<std::int64_t, 3>& cells);

 private:
  struct Kept {
    SolveOptions options;
    std::weak_ptr<LinearSolver> solver;
  };
  struct Spare {
    SolveOptions options;
    std::array<std::int64_t, 3> cells;
    std::shared_ptr<LinearSolver> solver;
  };
  std::vector<Kept> kept_;
  std::vector<Spare> spares_;
  std::vector<std::shared_ptr<SolveVectors>> vectors_;  // of grids of different sizes
};

/// For one program.
class SolverShelf {
 public:
  /// `team`: that of the program, used by its solves.
  explicit SolverShelf(const Team& team = 1, std::shared_ptr<SolverStore> store = std::make_shared<SolverStore>())
      : team_(team), store_(std::move(store)) {}

  const Team& team() const { return team_; }

  std::shared_ptr<LinearSolver> solver_of(std::shared_ptr<const GridOperator> grid_operator,
                                          const SolveOptions& options, std::shared_ptr<LinearSolver> spare = nullptr) {
    return store_->solver_of(std::move(grid_operator), options, team_, std::move(spare));
  }
  void give_spare(std::shared_ptr<LinearSolver> solver, const SolveOptions& options) {
    store_->give_spare(std::move(solver), options);
  }
  std::shared_ptr<LinearSolver> take_spare(const SolveOptions& options, const std::array<std::int64_t, 3>& cells) {
    return store_->take_spare(options, cells);
  }
  std::shared_ptr<SolveVectors> vectors(std::size_t cells, std::size_t guesses) {
    return store_->vectors(cells, guesses);
  }
  /// The note of a solve of the program; its address stays valid.
  SolveNote& add_note(std::string unknown) { return notes_.emplace_back(SolveNote{std::move(unknown)}); }
  std::deque<SolveNote>& notes() { return notes_; }

 private:
  Team team_;
  std::shared_ptr<SolverStore> store_;
  std::deque<SolveNote> notes_;
};

}  // namespace dpde
