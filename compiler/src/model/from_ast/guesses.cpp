// SPDX-License-Identifier: Apache-2.0
// What is solved for is kept as a state, with which solves of the next step begin. What the scheme says of solves and
// nothing follows.
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/parts.h"
#include "model/print_model.h"
#include "model/solves.h"

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
    draft.sink.report("guess-not-used", place_of(draft, "guess"),
                      {solves.empty() ? "no step of this scene solves an equation"
                                      : "the equations are solved wave by wave, without steps"},
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
