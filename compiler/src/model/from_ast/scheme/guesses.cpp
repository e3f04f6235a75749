// SPDX-License-Identifier: Apache-2.0
// Solutions are stored as states, as initial guesses for the next step's solves. Also reports settings for solves that
// have no effect.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "model/analyse/solves.h"
#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"
#include "model/uses.h"

namespace dpde::model {

namespace {

/// Range of the scheme's line with this key; for a setting, that of the scene's name.
SourceRange place_of(const Elaboration& elaboration, const std::string& key) {
  const auto* scheme = find_declaration<ast::Scheme>(elaboration.file, elaboration.problem.scheme.name);
  if (scheme == nullptr || elaboration.selection.overrides.contains(key)) return elaboration.blocks.scene->name.range;
  for (const auto& [row, range] : items_of<ast::ValueItem>(scheme->items)) {
    if (row.name.name == key) return range;
  }
  return elaboration.blocks.scene->name.range;
}

/// Removes guesses that are not in `known`.
Expr with_guesses(const Expr& e, const std::set<std::string>& known) {
  const auto is_other = [&](const Expr& part) {
    const auto* solve = as<Solve>(part);
    return solve != nullptr &&
           std::ranges::any_of(solve->guesses, [&](const std::string& guess) { return !known.contains(guess); });
  };
  if (!any_part(e, is_other)) return e;
  const Expr inside = map_children(e, [&](const Expr& part) { return with_guesses(part, known); });
  if (!is_other(inside)) return inside;
  Solve solve = std::get<Solve>(inside->kind);
  std::erase_if(solve.guesses, [&](const std::string& guess) { return !known.contains(guess); });
  return model::solve(std::move(solve), e->origin);
}

/// Why no solve starts from the last solution, although nothing forbids it.
std::string why_nothing_begins(const std::vector<const Solve*>& solves, const Problem& problem) {
  if (solves.empty()) return "no step of this scene solves an equation";
  const auto is_of_waves = [&](const Solve* solve) { return model::is_of_waves(*solve, problem.scheme); };
  if (std::ranges::all_of(solves, is_of_waves)) return "the equations are solved wave by wave, without steps";
  return "no equation, event or mask solves one, and what others solve for is not kept";
}

/// Adds a state that stores the value of `of` from one step before; returns its name.
std::string keep(Elaboration& elaboration, const Solve& solved, const std::string& of, const char* suffix,
                 const Origin& origin) {
  State guess;
  guess.name = name_of_memory(elaboration, solved.name, suffix);
  guess.history_of = of;
  guess.is_guess = true;
  guess.boundary = solved.boundary;
  guess.initial.formula = 0.0;
  guess.origin = origin;
  elaboration.solves.guesses.push_back(guess);
  return guess.name;
}

}  // namespace

std::optional<std::vector<Expr>> starts_of(Elaboration& elaboration, const std::vector<ast::Expr>& starts,
                                           const std::string& name) {
  std::vector<Expr> found;
  FormulaScope scope{elaboration, FormulaContext::equation, name};
  for (const ast::Expr& start : starts) {
    const auto value = formulas::number(scope, start);
    if (!value) return std::nullopt;
    const bool is_known = elaboration.problem.find_state(name) != nullptr;  // of a constraint: its last value
    if (!is_known && reads(*value, name)) {
      elaboration.sink.report("solve-does-not-fit", start.range(),
                              {name, "it begins with itself, which is not known yet"},
                              "take guess = last in the scheme, which begins with the last solution");
      return std::nullopt;
    }
    found.push_back(*value);
  }
  return found;
}

void refuse_starts(Elaboration& elaboration, const Solve& solved) {
  if (solved.starts.empty()) return;
  elaboration.sink.report(
      "schemes-do-not-fit", solved.starts.front()->origin.range,
      {print(elaboration.problem.scheme.time), "from " + print(solved.starts.front())},
      is_implicit(elaboration.problem.scheme.time)
          ? "implicit stages solve for what a step adds to " + solved.name +
                ": leave it out, or take an explicit scheme as time = rk2"
          : "each step solves for what it adds to " + solved.name + ": leave it out, or write each stage");
}

/// Whether the solve starts from the model's start values; reports methods without iterations.
static bool begins_with_starts(Elaboration& elaboration, Solve& solved) {
  if (solved.starts.empty()) return false;
  const Scheme& scheme = elaboration.problem.scheme;
  const bool is_by_steps = scheme.solve.method == SolveMethod::automatic || is_iterative(scheme.solve.method);
  const bool has_steps = is_by_steps && !is_of_waves(solved, scheme);
  if (scheme.guess == Guess::automatic && has_steps) return true;
  if (!has_steps)
    elaboration.sink.report("guess-not-used", solved.starts.front()->origin.range,
                            {"from " + print(solved.starts.front()),
                             fmt::format("solve = {} has no steps that could begin there", print(scheme.solve))},
                            "take cg or multigrid, or leave it out");
  solved.starts.clear();
  return false;
}

void add_guesses(Elaboration& elaboration, Solve& solved, const Origin& origin) {
  if (begins_with_starts(elaboration, solved)) return;
  const bool is_in_passes =
      !items_of<ast::SubcycleItem>(elaboration.blocks.scene->items).empty();  // substeps store no solution
  if (!uses_warm_start(elaboration.problem) || is_in_passes || is_of_waves(solved, elaboration.problem.scheme)) return;
  solved.guesses = {keep(elaboration, solved, solved.name, "_last", origin)};
  if (elaboration.problem.scheme.guess == Guess::extrapolate)
    solved.guesses.push_back(keep(elaboration, solved, solved.guesses.front(), "_before", origin));
}

void add_guesses_of_constraint(Elaboration& elaboration, Solve& solved, const Origin& origin) {
  if (begins_with_starts(elaboration, solved) || !uses_warm_start(elaboration.problem)) return;
  solved.guesses = {solved.name};
  if (elaboration.problem.scheme.guess == Guess::extrapolate)
    solved.guesses.push_back(keep(elaboration, solved, solved.name, "_before", origin));
}

void drop_idle_guesses(Elaboration& elaboration) {
  Problem& problem = elaboration.problem;
  std::set<std::string> found;
  for_each_formula(problem, [&](const Use& use) {
    if (!makes_state(use.kind)) return;  // the others are computed on request and store nothing
    any_part(use.formula, [&](const Expr& part) {
      if (const auto* solve = as<Solve>(part)) found.insert(solve->guesses.begin(), solve->guesses.end());
      return false;
    });
  });
  const auto is_idle = [&](const State& state) { return state.is_guess && !found.contains(state.name); };
  if (std::ranges::none_of(problem.states, is_idle)) return;
  std::erase_if(problem.states, is_idle);
  rewrite_formulas(problem, [&](const Use& use) { return with_guesses(use.formula, found); });
}

void check_guess(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  if (!is_asked_for(problem.scheme.guess)) return;
  const std::string guess = fmt::format("guess = {}", name_of(problem.scheme.guess));
  const std::vector<const Solve*> solves = solves_of(problem);
  if (std::ranges::any_of(solves, [](const Solve* solve) { return !solve->guesses.empty(); })) return;
  if (!uses_warm_start(problem) && !solves.empty()) {
    elaboration.sink.report(
        "guess-not-used", place_of(elaboration, "guess"),
        {guess, fmt::format("solve = {} has no steps that could begin there", print(problem.scheme.solve))},
        "take cg or multigrid, or leave it out");
    return;
  }
  const auto subcycles = items_of<ast::SubcycleItem>(elaboration.blocks.scene->items);
  if (!subcycles.empty() && !solves.empty()) {
    elaboration.sink.report("not-allowed-here", subcycles.front().range, {"subcycle", "a scene with " + guess},
                            "make all steps shorter, or take guess = none");
  } else if (std::ranges::any_of(problem.projections, &Projection::is_each_step)) {
    elaboration.sink.report("guess-not-used", place_of(elaboration, "guess"),
                            {guess, "a constraint each step solves for what the step adds to it"},
                            "leave it out: what is known of the last step is in the stages, or write each stage");
  } else if (is_implicit(problem.scheme.time)) {
    elaboration.sink.report(
        "schemes-do-not-fit", place_of(elaboration, "guess"), {print(problem.scheme.time), guess},
        "implicit stages solve for what a step adds, which is not like that of the step before: take "
        "guess = none, or an explicit scheme as time = rk2");
  } else {
    elaboration.sink.report("guess-not-used", place_of(elaboration, "guess"),
                            {guess, why_nothing_begins(solves, problem)}, "leave it out");
  }
}

void check_solve_keys(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  const SolveBy& by = problem.scheme.solve;
  const bool is_solved = is_implicit(problem.scheme.time) || !solves_of(problem).empty();
  const auto check = [&](const char* key, std::string_view value, bool is_used, const char* what, const char* instead) {
    if (is_solved && is_used) return;
    elaboration.sink.report(
        "solve-key-not-used", place_of(elaboration, key),
        {fmt::format("{} = {}", key, value),
         is_solved ? fmt::format("solve = {} has no {}", print(by), what) : "no step of this scene solves an equation"},
        is_solved ? fmt::format("take {}, or leave it out", instead) : "leave it out");
  };
  const bool is_automatic = by.method == SolveMethod::automatic;
  const std::vector<const Solve*> solves = solves_of(problem);
  const auto is_by_waves = [&](const Solve* solve) { return is_of_waves(*solve, problem.scheme); };
  if (!is_automatic && by.method != SolveMethod::fourier && !solves.empty() && std::ranges::all_of(solves, is_by_waves))
    elaboration.sink.report(
        "solve-key-not-used", place_of(elaboration, "solve"),
        {fmt::format("solve = {}", print(by)), "derivatives by Fourier series are solved wave by wave"},
        "leave it out, or take lap and dx = central(2)");
  const bool has_steps = is_iterative(by.method);
  if (by.smoother != Smoother::automatic) {
    const bool has_cycles =
        has_steps && (by.method == SolveMethod::multigrid || by.preconditioner != Preconditioner::none);
    check("smoother", name_of(by.smoother), is_automatic || has_cycles, "cycles of multigrid", "multigrid or cg");
  }
  if (by.preconditioner != Preconditioner::automatic)
    check("preconditioner", name_of(by.preconditioner), has_steps && by.method != SolveMethod::multigrid,
          "iterations that are preconditioned", "cg, bicgstab or gmres");
}

}  // namespace dpde::model
