// SPDX-License-Identifier: Apache-2.0
// What is solved for is kept as a state, with which solves of the next step begin. What the scheme says of solves and
// nothing follows.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "model/build.h"
#include "model/from_ast/parts.h"
#include "model/print_model.h"
#include "model/solves.h"
#include "model/uses.h"

namespace dpde::model {

namespace {

/// The range of the scheme's row of this key, else, as of a setting, that of the scene's name.
SourceRange place_of(const Draft& draft, const std::string& key) {
  const auto* scheme = find_declaration<ast::Scheme>(draft.file, draft.problem.scheme.name);
  if (scheme == nullptr || draft.selection.overrides.contains(key)) return draft.scene->name.range;
  for (const auto& [row, range] : items_of<ast::ValueItem>(scheme->items)) {
    if (row.name.name == key) return range;
  }
  return draft.scene->name.range;
}

/// Without guesses that are not among `known`.
Expr with_guesses(const Expr& e, const std::set<std::string>& known) {
  const auto is_other = [&](const Expr& part) {
    const auto* solve = std::get_if<Solve>(&part->kind);
    return solve != nullptr && !solve->guess.empty() && !known.contains(solve->guess);
  };
  if (!any_part(e, is_other)) return e;
  const Expr inside = map_parts(e, [&](const Expr& part) { return with_guesses(part, known); });
  if (!is_other(inside)) return inside;
  Solve solve = std::get<Solve>(inside->kind);
  solve.guess.clear();
  return model::solve(std::move(solve), e->origin);
}

/// Why no solve begins with the last solution, which nothing forbids.
std::string why_nothing_begins(const std::vector<const Solve*>& solves, const Problem& problem) {
  if (solves.empty()) return "no step of this scene solves an equation";
  const auto is_of_waves = [&](const Solve* solve) { return model::is_of_waves(*solve, problem.scheme); };
  if (std::ranges::all_of(solves, is_of_waves)) return "the equations are solved wave by wave, without steps";
  return "no equation, event or mask solves one, and what others solve for is not kept";
}

}  // namespace

std::string add_guess(Draft& draft, const Solve& solved, const Origin& origin) {
  const bool is_in_passes = !items_of<ast::SubcycleItem>(draft.scene->items).empty();  // which keep nothing of it
  if (!begins_with_last(draft.problem) || is_in_passes || is_of_waves(solved, draft.problem.scheme)) return "";
  State guess;
  guess.name = name_of_memory(draft, solved.name, "_last");
  guess.history_of = solved.name;
  guess.is_guess = true;
  guess.boundary = solved.boundary;
  guess.initial.formula = 0.0;
  guess.origin = origin;
  draft.guesses.push_back(guess);
  return guess.name;
}

void drop_idle_guesses(Draft& draft) {
  Problem& problem = draft.problem;
  std::set<std::string> found;
  for_each_formula(problem, [&](const Use& use) {
    if (!makes_state(use.kind)) return;  // others are made when somebody asks, and store nothing
    any_part(use.formula, [&](const Expr& part) {
      if (const auto* solve = std::get_if<Solve>(&part->kind)) found.insert(solve->guess);
      return false;
    });
  });
  const auto is_idle = [&](const State& state) { return state.is_guess && !found.contains(state.name); };
  if (std::ranges::none_of(problem.states, is_idle)) return;
  std::erase_if(problem.states, is_idle);
  rewrite_formulas(problem, [&](const Use& use) { return with_guesses(use.formula, found); });
}

void check_guess(Draft& draft) {
  const Problem& problem = draft.problem;
  if (problem.scheme.guess != Guess::last) return;
  const std::vector<const Solve*> solves = solves_of(problem);
  if (std::ranges::any_of(solves, [](const Solve* solve) { return !solve->guess.empty(); })) return;
  if (!begins_with_last(problem) && !solves.empty()) {
    draft.sink.report("guess-not-used", place_of(draft, "guess"),
                      {fmt::format("solve = {} has no steps that could begin there", print(problem.scheme.solve))},
                      "take cg or multigrid, or leave it out");
    return;
  }
  const auto subcycles = items_of<ast::SubcycleItem>(draft.scene->items);
  if (!subcycles.empty() && !solves.empty()) {
    draft.sink.report("not-allowed-here", subcycles.front().range, {"subcycle", "a scene with guess = last"},
                      "make all steps shorter, or take guess = none");
  } else if (is_implicit(problem.scheme.time)) {
    draft.sink.report("schemes-do-not-fit", place_of(draft, "guess"), {print(problem.scheme.time), "guess = last"},
                      "implicit stages solve for what a step adds, which is not like that of the step before: take "
                      "guess = none, or an explicit scheme as time = rk2");
  } else {
    draft.sink.report("guess-not-used", place_of(draft, "guess"), {why_nothing_begins(solves, problem)},
                      "leave it out");
  }
}

void check_smoother(Draft& draft) {
  const Problem& problem = draft.problem;
  const SolveBy& by = problem.scheme.solve;
  if (by.smoother == Smoother::automatic) return;
  const bool has_cycles = by.method == SolveMethod::automatic || comes_near_by_steps(by.method);
  const bool is_solved = is_implicit(problem.scheme.time) || !solves_of(problem).empty();
  if (has_cycles && is_solved) return;
  draft.sink.report("smoother-not-used", place_of(draft, "smoother"),
                    {std::string(name_of(by.smoother)), is_solved ? fmt::format("solve = {} has none", print(by))
                                                                  : "no step of this scene solves an equation"},
                    is_solved ? "take multigrid or cg, or leave it out" : "leave it out");
}

}  // namespace dpde::model
