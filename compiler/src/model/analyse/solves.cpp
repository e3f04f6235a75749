// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/solves.h"

#include <algorithm>
#include <functional>

#include "model/build.h"
#include "model/uses.h"
#include "support/assert.h"

namespace dpde::model {

std::vector<const Solve*> solves_of(const Problem& problem) {
  std::vector<const Solve*> known;
  const std::function<bool(const Expr&)> look = [&](const Expr& e) {
    const Solve* solve = as<Solve>(e);
    const auto is_it = [&](const Solve* other) { return *other == *solve; };
    if (solve == nullptr || std::ranges::any_of(known, is_it)) return false;
    any_part(solve->operation, look);
    any_part(solve->right, look);
    known.push_back(solve);
    return false;
  };
  for_each_formula(problem, [&](const Use& use) {
    if (is_of_states(use.kind)) any_part(use.formula, look);  // the others contain no solves
  });
  return known;
}

namespace {

/// `order`: total order of the derivatives around `e`.
bool is_of_waves(const Expr& e, const std::string& unknown, const Scheme& scheme, int order) {
  const auto rest = [&](const Expr& part) { return is_of_waves(part, unknown, scheme, order); };
  if (const Field* field = as<Field>(e)) return field->name == unknown && order % 2 == 0;
  if (const Neg* neg = as<Neg>(e)) return rest(neg->operand);
  if (const Derivative* d = as<Derivative>(e))
    return is_spectral(scheme, e) && is_of_waves(d->operand, unknown, scheme, order + d->order);
  const Binary* b = as<Binary>(e);
  if (b == nullptr) return false;
  switch (b->op) {
    case BinaryOp::add:
    case BinaryOp::subtract: return rest(b->left) && rest(b->right);
    case BinaryOp::multiply: return (is_uniform(b->left) && rest(b->right)) || (is_uniform(b->right) && rest(b->left));
    case BinaryOp::divide: return is_uniform(b->right) && rest(b->left);
    case BinaryOp::power:
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: return false;
  }
  unreachable("operator");
}

}  // namespace

bool holds_waves(const Solve& solve, const Scheme& scheme) {
  return any_part(solve.operation, [&](const Expr& e) { return is_spectral(scheme, e); });
}

bool is_of_waves(const Solve& solve, const Scheme& scheme) {
  return holds_waves(solve, scheme) && is_of_waves(solve.operation, solve.name, scheme, 0);
}

bool holds_odd_orders(const Solve& solve) {
  return any_part(solve.operation, [](const Expr& e) {
    const Derivative* d = as<Derivative>(e);
    return d != nullptr && d->order % 2 != 0;
  });
}

bool is_iterative(SolveMethod method) {
  switch (method) {
    case SolveMethod::automatic:
    case SolveMethod::direct:
    case SolveMethod::tridiagonal:
    case SolveMethod::fourier: return false;
    case SolveMethod::multigrid:
    case SolveMethod::cg:
    case SolveMethod::bicgstab:
    case SolveMethod::gmres: return true;
  }
  unreachable("kind of solve");
}

bool uses_warm_start(const Problem& problem) {
  const Guess guess = problem.scheme.guess;
  const SolveMethod method = problem.scheme.solve.method;
  if (guess == Guess::none) return false;
  if (method != SolveMethod::automatic) return is_iterative(method);
  const auto is_held = [](const State& state) { return state.held.has_value(); };
  return is_asked_for(guess) || std::ranges::any_of(problem.states, is_held);
}

bool are_constraints(const Problem& problem) {
  return std::ranges::all_of(solves_of(problem), [&](const Solve* solve) {
    return std::ranges::any_of(problem.projections, [&](const Projection& projection) {
      return projection.potential && std::get<Solve>((*projection.potential)->kind) == *solve;
    });
  });
}

}  // namespace dpde::model
