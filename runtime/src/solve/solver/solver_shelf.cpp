// SPDX-License-Identifier: Apache-2.0
#include "solve/solver/solver_shelf.h"

#include <algorithm>

namespace dpde {

std::shared_ptr<LinearSolver> SolverStore::solver_of(std::shared_ptr<const GridOperator> grid_operator,
                                                     const SolveOptions& options, const Team& team,
                                                     std::shared_ptr<LinearSolver> spare) {
  std::erase_if(kept_, [](const Kept& kept) { return kept.solver.expired(); });
  for (const Kept& kept : kept_) {
    std::shared_ptr<LinearSolver> solver = kept.solver.lock();
    if (kept.options != options || *solver->grid_operator() != *grid_operator) continue;
    if (spare != nullptr) {
      const std::array<std::int64_t, 3> cells = grid_operator->cells();
      spare->keep_operator(std::move(grid_operator));
      spares_.push_back({options, cells, std::move(spare)});
    }
    return solver;
  }
  if (spare == nullptr || !spare->renew(grid_operator)) {
    spare.reset();  // frees its memory for the new one
    spare = std::make_shared<LinearSolver>(std::move(grid_operator), options, team);
  }
  kept_.push_back({options, spare});
  return spare;
}

void SolverStore::give_spare(std::shared_ptr<LinearSolver> solver, const SolveOptions& options) {
  if (solver == nullptr || solver.use_count() > 1) return;
  const auto known = std::ranges::find_if(kept_, [&](const Kept& kept) { return kept.solver.lock() == solver; });
  if (known == kept_.end()) return;
  const bool is_wanted = known->options == options;
  kept_.erase(known);
  if (!is_wanted) return;
  const std::array<std::int64_t, 3> cells = solver->grid_operator()->cells();
  spares_.push_back({options, cells, std::move(solver)});
}

std::shared_ptr<LinearSolver> SolverStore::take_spare(const SolveOptions& options,
                                                      const std::array<std::int64_t, 3>& cells) {
  const auto known = std::ranges::find_if(
      spares_, [&](const Spare& spare) { return spare.options == options && spare.cells == cells; });
  if (known == spares_.end()) return nullptr;
  std::shared_ptr<LinearSolver> solver = std::move(known->solver);
  spares_.erase(known);
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
