// SPDX-License-Identifier: Apache-2.0
// Time schemes with memory. ab2 stores the right-hand side u_rate of the step before; ab3 also u_rate_old, the u_rate
// of the step before that; leapfrog stores the value u_old. All are states that start from 0 and are not used by the
// first steps. With leapfrog, an equation of second order needs none, since its velocity is stored. Initial guesses of
// solves are memory, too.
#include "model/build.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"
#include "model/uses.h"

namespace dpde::model {

namespace {

bool is_leapfrog(const Elaboration& elaboration) { return model::is_leapfrog(elaboration.problem.scheme.time); }

bool needs_history(const Elaboration& elaboration, const State& state) {
  if (!state.rhs || is_literal(*state.rhs, 0)) return false;
  if (is_adams_bashforth(elaboration.problem.scheme.time)) return true;
  return is_leapfrog(elaboration) && state.velocity_of.empty() && !elaboration.problem.velocity_of(state.name);
}

/// Leapfrog's velocity belongs to half a step before. Only a term that damps the velocity itself is then of order 2.
void check_velocity(Elaboration& elaboration, const State& velocity) {
  const auto check = [&](bool fine, const Origin& origin) {
    if (fine) return;
    elaboration.sink.report("velocity-not-kept", origin.range, {velocity.velocity_of, velocity.velocity_of},
                            "take time = verlet, whose velocity is that of the same time");
  };
  const Problem& problem = elaboration.problem;
  const auto is_free = [&](const Expr& e) { return !reads(e, velocity.name); };
  for_each_formula(problem, [&](const Use& use) {
    const bool is_equation = use.kind == UseKind::equation;
    if (!is_of_states(use.kind) || (is_equation && use.owner == velocity.velocity_of)) return;  // others read no state
    const bool is_own = is_equation && use.owner == velocity.name;
    check(is_own ? linear_in(use.formula, velocity.name).has_value() : is_free(use.formula), use.origin);
  });
}

}  // namespace

std::string name_of_memory(const Elaboration& elaboration, const std::string& of, const std::string& suffix) {
  const auto is_observed = [&](const std::string& name) {
    const auto is_it = [&](const auto& item) { return item.kind.name.name == name; };
    return std::ranges::any_of(items_of<ast::ObserveItem>(elaboration.blocks.scene->items), is_it) ||
           (elaboration.blocks.task != nullptr &&
            std::ranges::any_of(items_of<ast::DataItem>(elaboration.blocks.task->items), is_it));
  };
  const auto is_taken = [&](const std::string& name) {
    const auto is_let = [&](const auto& let) { return let.kind.name.name == name; };
    return elaboration.names.scope.find(name) != nullptr || is_observed(name) ||
           (!vector_of(name).empty() && elaboration.names.scope.find(vector_of(name)) != nullptr) ||
           std::ranges::any_of(items_of<ast::LetItem>(elaboration.blocks.model->items), is_let) ||
           std::ranges::any_of(items_of<ast::SolvedItem>(elaboration.blocks.model->items),
                               [&](const auto& solved) { return solved.kind.unknown.name == name; });
  };
  std::string name = name_beside(of, suffix);
  for (int n = 2; is_taken(name); ++n) name = name_beside(of, suffix + "_" + std::to_string(n));
  return name;
}

void add_histories(Elaboration& elaboration) {
  const TimeScheme time = elaboration.problem.scheme.time;
  std::vector<State> histories;
  const auto add = [&](const State& of, const std::string& suffix, const Origin& origin) {
    State history;
    history.name = name_of_memory(elaboration, of.name, suffix);
    history.history_of = of.name;
    history.boundary = of.boundary;
    history.placement = of.placement;
    history.initial.formula = 0.0;
    if (declare(elaboration, {history.name, origin.range}, Role::state)) histories.push_back(history);
    return history;
  };
  for (const State& state : elaboration.problem.states) {
    if (!needs_history(elaboration, state)) continue;
    State history = add(state, is_adams_bashforth(time) ? "_rate" : "_old", state.origin);
    for (std::size_t step = 2; step < time->rates.size(); ++step) history = add(history, "_old", state.origin);
  }
  elaboration.problem.states.insert(elaboration.problem.states.end(), histories.begin(), histories.end());
  for (State& guess : elaboration.solves.guesses) {
    if (declare(elaboration, {guess.name, guess.origin.range}, Role::state))
      elaboration.problem.states.push_back(std::move(guess));
  }
}

void check_histories(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  if (!elaboration.blocks.model || !is_multistep(problem.scheme.time)) return;
  const std::string time = print(problem.scheme.time);
  if (problem.scheme.is_semi_lagrangian()) {
    elaboration.sink.report("schemes-do-not-fit", problem.states.front().origin.range,
                            {time, "semi-Lagrangian advection"},
                            "take time = rk2, or advect = central(2) or upwind(3)");
  }
  if (problem.substeps.courant > 0) {
    elaboration.sink.report("schemes-do-not-fit", problem.time_origin.range,
                            {time, "steps limited by a Courant number"}, "take time = rk2 or ssp_rk3");
  }
  if (!problem.events.empty()) {  // the stored values would be those before the event
    elaboration.sink.report("schemes-do-not-fit", problem.events.front().origin.range,
                            {time, "values that change after steps"}, "take time = rk2 or rk4");
  }
  if (!is_leapfrog(elaboration)) return;
  for (const State& state : problem.states) {
    if (!state.velocity_of.empty()) check_velocity(elaboration, state);
  }
}

}  // namespace dpde::model
