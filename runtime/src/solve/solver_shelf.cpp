// SPDX-License-Identifier: Apache-2.0
#include "solve/solver_shelf.h"

#include <algorithm>

namespace dpde {

std::shared_ptr<LinearSolver> SolverStore::solver_of(std::shared_ptr<const GridOperator> grid_operator,
                                                     const SolveOptions& options, const Team& team) {
  std::erase_if(kept_, [](const Kept& kept) { return kept.solver.expired(); });
  for (const Kept& kept : kept_) {
    std::shared_ptr<LinearSolver> solver = kept.solver.lock();
    if (kept.options == options && *solver->grid_operator() == *grid_operator) return solver;
  }
  auto solver = std::make_shared<LinearSolver>(std::move(grid_operator), options, team);
  kept_.push_back({options, solver});
  return solver;
}

std::shared_ptr<SolveVectors> SolverStore::vectors(std::size_t cells, std::size_t guesses) {
  const auto known = std::ranges::find_if(vectors_, [&](const auto& one) { return one->right.size() == cells; });
  if (known == vectors_.end()) {
    auto made = std::make_shared<SolveVectors>();
    for (std::vector<double>* values : {&made->right, &made->solution}) values->assign(cells, 0.0);
    made->guesses.assign(cells * guesses, 0.0);
    return vectors_.emplace_back(std::move(made));
  }
  if ((*known)->guesses.size() < cells * guesses) (*known)->guesses.resize(cells * guesses);
  return *known;
}

}  // namespace dpde
