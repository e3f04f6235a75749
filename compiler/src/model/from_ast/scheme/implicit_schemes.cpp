// SPDX-License-Identifier: Apache-2.0
// Checks of implicit time schemes: implicit terms consist of differences, and there is at least one.
#include <fmt/format.h>

#include <algorithm>

#include "model/analyse/implicit_part.h"
#include "model/analyse/split_terms.h"
#include "model/boundary/metric.h"
#include "model/build.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"

namespace dpde::model {

namespace {

/// Conflicts with other parts of the scheme.
std::optional<Obstacle> obstacle(const Problem& problem) {
  const Scheme& scheme = problem.scheme;
  if (scheme.is_semi_lagrangian() && !scheme.is_split())
    return Obstacle{"semi-Lagrangian advection in one step with other terms",
                    "write split = lie(advect, sources, diffusion) in the scheme, or take advect = upwind(3)"};
  if (scheme.derivative_order == spectral || scheme.laplacian_order == spectral)
    return Obstacle{"derivatives by Fourier series",
                    problem.projections.empty()
                        ? "take dx and lap = central(4), or time = etdrk4"
                        : "take time = rk4, or velocities on faces and dx and lap = central(2)"};
  if (scheme.dealias) return Obstacle{"dealias = two_thirds", "take time = etdrk4"};
  return std::nullopt;
}

bool holds_state(const Problem& problem, const Expr& e) {
  return std::ranges::any_of(problem.states, [&](const State& state) {
    return problem.find_projection(state.name) == nullptr && reads(e, state.name);  // multipliers are known
  });
}

/// Features that a Newton solve cannot contain.
std::optional<Obstacle> newton_obstacle(const Problem& problem, const State& state, const Expr& part) {
  if (problem.scheme.is_split())
    return Obstacle{fmt::format("implicit = {} and split steps", name_of(problem.scheme.implicit)),
                    "take implicit = linear, or leave split out"};
  const std::string where = fmt::format(" in what it solves for in the equation for {}", state.name);
  const auto holds = [&](const auto& is_it) { return any_part(part, is_it); };
  if (holds([](const Expr& e) { return is<NetworkCall>(e); }))
    return Obstacle{"a network" + where, "take implicit = linear"};
  if (holds([](const Expr& e) { return is<Solve>(e); })) return Obstacle{"a solve" + where, "take implicit = linear"};
  return std::nullopt;
}

/// Conflicts with an equation. parts.part: its implicit terms.
std::optional<Obstacle> obstacle(const Problem& problem, const State& state, const LinearPart& parts) {
  if (problem.scheme.implicit != Implicit::linear) {
    if (const auto found = newton_obstacle(problem, state, parts.part)) return found;
  }
  if (reads_across_pole(problem, parts.part))
    return Obstacle{
        fmt::format("terms that read across a pole in what it solves for in the equation for {}", state.name),
        "with dx = central(2) lap(u) and div(k*grad(u)) of numbers end at poles; leave other terms explicit"};
  const bool is_carried =
      problem.scheme.is_split() && is_semi_lagrangian(problem.scheme.transport_of(state.name).advect);
  const Expr rest = is_carried ? terms_for(problem, state.name, *state.rhs, Split::Terms::sources) : parts.rest;
  if (is_trapezoidal(problem.scheme.time) && holds_state(problem, rest))
    return Obstacle{fmt::format("an equation for {} with terms of fields that it does not solve for", state.name),
                    "take time = ars222, which takes other terms explicitly"};
  return std::nullopt;
}

/// With an explicit time scheme a choice of implicit terms has no effect.
void check_explicit(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  if (problem.scheme.implicit == Implicit::linear) return;
  elaboration.sink.report("schemes-do-not-fit", problem.states.front().origin.range,
                          {print(problem.scheme.time), fmt::format("implicit = {}", name_of(problem.scheme.implicit))},
                          "take time = ars222, or leave implicit out");
}

}  // namespace

void check_implicit(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  if (!elaboration.blocks.model || problem.states.empty()) return;
  if (!is_implicit(problem.scheme.time)) return check_explicit(elaboration);
  const auto report = [&](SourceRange range, const Obstacle& found) {
    elaboration.sink.report("schemes-do-not-fit", range, {print(problem.scheme.time), found.what}, found.hint);
  };
  const SourceRange begin = problem.states.front().origin.range;
  if (const auto found = obstacle(problem)) return report(begin, *found);
  bool solves = false;
  for (const State& state : problem.states) {
    if (!state.rhs) continue;
    const LinearPart parts = implicit_part(problem, state.name, *state.rhs);
    solves = solves || !is_literal(parts.part, 0);
    if (const auto found = obstacle(problem, state, parts)) return report(state.origin.range, *found);
  }
  if (!solves) {
    report(begin, {"equations without a term that it solves for",
                   "it takes terms like nu*lap(u) of dt(u) implicitly, with factors that hold no field of an equation; "
                   "take time = rk2, or implicit = all for other terms too"});
  }
}

}  // namespace dpde::model
