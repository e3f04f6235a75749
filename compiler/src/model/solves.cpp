// SPDX-License-Identifier: Apache-2.0
#include "model/solves.h"

#include <algorithm>
#include <functional>

#include "model/build.h"

namespace dpde::model {

std::vector<const Solve*> solves_of(const Problem& problem) {
  std::vector<const Solve*> known;
  const std::function<bool(const Expr&)> look = [&](const Expr& e) {
    const Solve* solve = std::get_if<Solve>(&e->kind);
    const auto is_it = [&](const Solve* other) { return *other == *solve; };
    if (solve == nullptr || std::ranges::any_of(known, is_it)) return false;
    any_part(solve->operation, look);
    any_part(solve->right, look);
    known.push_back(solve);
    return false;
  };
  for (const State& state : problem.states) {
    if (state.rhs) any_part(*state.rhs, look);
  }
  for (const Projection& projection : problem.projections)
    if (projection.potential) any_part(*projection.potential, look);
  for (const Quantity& observable : problem.observables) any_part(observable.value, look);
  if (!problem.task) return known;
  for (const Loss& loss : problem.task->losses) any_part(loss.value, look);
  for (const Test& test : problem.task->tests) any_part(test.quantity.value, look);
  return known;
}

bool are_constraints(const Problem& problem) {
  return std::ranges::all_of(solves_of(problem), [&](const Solve* solve) {
    return std::ranges::any_of(problem.projections, [&](const Projection& projection) {
      return projection.potential && std::get<Solve>((*projection.potential)->kind) == *solve;
    });
  });
}

}  // namespace dpde::model
