// SPDX-License-Identifier: Apache-2.0
// Solvers of one program. Solves with the same matrix, as those of the stages of a time scheme, share one.
#pragma once

#include <memory>
#include <vector>

#include "solve/linear_solver.h"

namespace dpde {

class SolverShelf {
 public:
  /// \throws dpde::Error as LinearSolver does.
  std::shared_ptr<LinearSolver> solver_of(const StencilMatrix& matrix, const SolveOptions& options);

 private:
  struct Kept {
    StencilMatrix matrix;
    SolveOptions options;
    std::weak_ptr<LinearSolver> solver;
  };
  std::vector<Kept> kept_;
};

}  // namespace dpde
