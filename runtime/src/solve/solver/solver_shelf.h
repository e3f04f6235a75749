// SPDX-License-Identifier: Apache-2.0
// Solvers of programs that run one after the other, and what the solves of one program have met. Solves with the same
// matrix, as those of the stages of a time scheme and of their adjoints, share one solver.
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

/// What a solve works on, and nothing that it remembers: all solves of a store have the same.
struct SolveVectors {
  std::vector<double> right, solution, guesses;
};

class SolverStore {
 public:
  /// At least so many guesses, one behind the other.
  std::shared_ptr<SolveVectors> vectors(std::size_t cells, std::size_t guesses);
  /// It stays as long as somebody holds it. Operators are compared with those that solvers hold. `spare`: one of
  /// take_spare(), or null.
  /// \throws dpde::Error as LinearSolver does.
  std::shared_ptr<LinearSolver> solver_of(std::shared_ptr<const GridOperator> grid_operator,
                                          const SolveOptions& options, const Team& team,
                                          std::shared_ptr<LinearSolver> spare = nullptr);
  /// Keeps a solver of these options that nobody else holds, and that was made by solver_of(), until another takes its
  /// memory.
  void give_spare(std::shared_ptr<LinearSolver> solver, const SolveOptions& options);
  /// With these options and so many cells, or null.
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

/// Of one program.
class SolverShelf {
 public:
  /// `team`: of the program, which solves share their work among.
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
  /// Of a solve of the program: it stays where it is.
  SolveNote& add_note(std::string unknown) { return notes_.emplace_back(SolveNote{std::move(unknown)}); }
  std::deque<SolveNote>& notes() { return notes_; }

 private:
  Team team_;
  std::shared_ptr<SolverStore> store_;
  std::deque<SolveNote> notes_;
};

}  // namespace dpde
