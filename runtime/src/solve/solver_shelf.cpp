// SPDX-License-Identifier: Apache-2.0
#include "solve/solver_shelf.h"

#include <algorithm>

namespace dpde {

std::shared_ptr<LinearSolver> SolverStore::solver_of(const StencilMatrix& matrix, const SolveOptions& options,
                                                     const Team& team) {
  std::erase_if(kept_, [](const Kept& kept) { return kept.solver.expired(); });
  for (const Kept& kept : kept_) {
    if (kept.options == options && kept.matrix == matrix) return kept.solver.lock();
  }
  auto solver = std::make_shared<LinearSolver>(matrix, options, team);
  kept_.push_back({matrix, options, solver});
  return solver;
}

}  // namespace dpde
