// SPDX-License-Identifier: Apache-2.0
// Runs all checks first; then lowering, which cannot fail. The model level has checked orders of derivatives and
// schemes, and that scalar quantities are linear in reductions.
#include "stencil/lower/from_model.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "model/build.h"
#include "model/uses.h"
#include "stencil/build.h"
#include "stencil/lower/custom_adjoint.h"
#include "stencil/lower/events.h"
#include "stencil/lower/lowering.h"
#include "stencil/lower/unread_boundaries.h"
#include "stencil/passes/place_fills.h"
#include "stencil/space/operator_order.h"
#include "stencil/space/quantities.h"
#include "stencil/space/semi_lagrangian.h"
#include "stencil/time/exponential.h"
#include "stencil/time/iterations_from_model.h"
#include "stencil/time/projections.h"
#include "stencil/time/step.h"
#include "stencil/time/watched_stages.h"
#include "support/assert.h"
#include "support/contains.h"
#include "support/names/name_supply.h"

namespace dpde::stencil {

namespace {

/// Checks the formulas of an operator's custom adjoint.
void check_given(const Prerequisite& made, DiagnosticSink& sink) {
  const Kernel* kernel = std::get_if<Kernel>(&made);
  for (std::size_t i = 0; kernel && i < kernel->custom_adjoints.size(); ++i) {
    const CustomAdjoint& given = kernel->custom_adjoints[i];
    if (const auto problem = find_problem(*kernel, given)) {
      sink.report("bad-given-adjoint", given.origin.range, {given.input, kernel->name, problem->what}, problem->hint);
    }
  }
}

/// Result of a formula: a field, or a number from sums over the grid.
enum class Made { field, sums };
/// nullopt if the formula is not discretised on its own.
std::optional<Made> made(model::UseKind kind) {
  using enum model::UseKind;
  switch (kind) {
    case equation:
    case potential:
    case constraint:
    case correction:
    case event:
    case courant_rate:
    case output:
    case test_field:
    case initial:
    case coefficient:
    case unknown_start:
    case exact: return Made::field;
    case observable:
    case loss:
    case test: return Made::sums;
    case held_where:
    case held_value: return std::nullopt;  // part of a correction
    case control:
    case control_start: return std::nullopt;  // formulas of t
    case boundary_value:
    case boundary_weight: return std::nullopt;  // formulas of positions and values next to the wall
    case stretch_map:
    case metric: return std::nullopt;           // formulas of coordinates
    case stated_operator: return std::nullopt;  // measured, see operator_order.h
  }
  unreachable("kind of use");
}

/// Lowers a formula to check that its differences do not exceed max_parts.
void check_size(const Lowering& lowering, const model::Use& use, Made as, DiagnosticSink& sink) {
  const model::Expr& e = use.formula;
  Discretiser at_point = lowering.discretiser();
  switch (as) {
    case Made::sums: cell_share(e, lowering.rank(), at_point); break;
    case Made::field: {
      const model::Placements& placements = at_point.placements();
      at_point(e, placements.is_staggered() ? placements.natural(e).value_or(model::Placement{}) : model::Placement{});
    }
  }
  for (const Prerequisite& made : at_point.preparations()) check_given(made, sink);
  if (!at_point.gave_up()) return;
  sink.report("too-many-differences", e->origin.range.is_known() ? e->origin.range : use.origin.range,
              {std::to_string(max_parts)}, "nest fewer derivatives, or choose lower orders in the scheme");
}

void check_time_scheme(const model::Problem& problem, DiagnosticSink& sink) {
  const auto is_velocity = [](const model::State& state) { return !state.velocity_of.empty(); };
  if (!model::is_verlet(problem.scheme.time) || !problem.program.empty()) return;
  if (std::any_of(problem.states.begin(), problem.states.end(), is_velocity)) return;
  sink.report("needs-second-derivative", problem.states.front().origin.range, {"verlet", problem.model},
              "take time = rk2 or rk4 in the scheme");
}

bool check(const Lowering& lowering, DiagnosticSink& sink) {
  const model::Problem& problem = lowering.problem();
  const std::size_t before = sink.all().size();
  check_time_scheme(problem, sink);
  if (problem.scheme.is_semi_lagrangian()) check_semi_lagrangian(problem, sink);
  model::for_each_formula(problem, [&](const model::Use& use) {
    if (const std::optional<Made> as = made(use.kind)) check_size(lowering, use, *as, sink);
  });
  if (sink.all().size() == before) check_iterations(lowering, sink);
  return sink.all().size() == before;
}

/// A field and its formula.
struct Formula {
  std::string field;
  model::Expr value;
  Origin origin;
  model::Placement placement;
};

/// Whether the formula, or the boundary value of the field on a high wall, reads one of these fields.
bool reads_any(const model::Problem& problem, const Formula& formula, const std::vector<std::string>& fields) {
  const auto reads = [&](const model::Expr& e) {
    return any_part(e, [&](const model::Expr& part) {
      const auto* field = as<model::Field>(part);
      return field && contains(fields, field->name);
    });
  };
  const auto state = std::ranges::find(problem.states, formula.field, &model::State::name);
  if (state == problem.states.end()) return reads(formula.value);
  return reads(formula.value) || std::ranges::any_of(state->boundary, [&](const model::AxisSides& sides) {
           return condition_of(sides.high.kind).gives_value() && reads(sides.high.value);
         });
}

/// Kernels that store the formulas, in order; a formula that reads a field stored before it begins a new kernel.
std::vector<Stage> formula_stages(const Lowering& lowering, const std::string& name,
                                  const std::vector<Formula>& formulas) {
  std::vector<Stage> stages;
  std::vector<std::string> stored;
  Kernel kernel;
  Discretiser at_point = lowering.discretiser();
  const auto begin = [&] {
    kernel = lowering.kernel(stages.empty() ? name : name + "_" + std::to_string(stages.size() + 1));
    at_point = lowering.discretiser();
    stored.clear();
  };
  const auto end = [&] { stages.push_back(Lowering::stage(std::move(kernel), at_point)); };
  begin();
  for (const Formula& formula : formulas) {
    if (reads_any(lowering.problem(), formula, stored)) {
      end();
      begin();
    }
    kernel.stores.push_back({formula.field, false, at_point(formula.value, formula.placement), formula.origin});
    stored.push_back(formula.field);
  }
  end();
  return stages;
}

/// Adds a program that stores the formulas' fields as results; no program without formulas.
void add_formulas(Module& module, const Lowering& lowering, const std::string& name,
                  const std::vector<Formula>& formulas) {
  if (formulas.empty()) return;
  Program& program =
      lowering.add_program(module, name, formula_stages(lowering, name, formulas), lowering.problem().t_begin);
  for (const Formula& formula : formulas) program.keeps.push_back(formula.field);
}

std::vector<Formula> coefficient_formulas(const model::Problem& problem) {
  std::vector<Formula> formulas;
  for (const model::Coefficient& c : problem.coefficients) {
    if (c.value.formula && !c.is_control()) formulas.push_back({c.name, *c.value.formula, c.value.origin, c.placement});
  }
  return formulas;
}

std::vector<Formula> initial_formulas(const model::Problem& problem) {
  std::vector<Formula> formulas;
  for (const model::State& s : problem.states) {
    if (s.initial.formula) formulas.push_back({s.name, *s.initial.formula, s.initial.origin, s.placement});
  }
  return formulas;
}

/// Initial states from their formulas, projected if the constraint must hold at the start.
void add_initial(Module& module, Lowering& lowering, const std::string& name) {
  const model::Problem& problem = lowering.problem();
  std::vector<Formula> formulas = initial_formulas(problem);
  FieldsOfStates before, into;
  for (const model::State& state : problem.states) {
    if (state.projected) into[state.name] = state.name;
    if (state.projected) before[state.name] = lowering.field_beside(state.name, "given");
  }
  if (into.empty()) return add_formulas(module, lowering, name, formulas);
  for (Formula& formula : formulas) {
    if (before.contains(formula.field)) formula.field = before.at(formula.field);
  }
  std::vector<Stage> stages = formula_stages(lowering, name, formulas);
  std::ranges::move(projection_stages(lowering, {name, before, into, problem.t_begin, 1.0, 1.0}),
                    std::back_inserter(stages));
  Program& program = lowering.add_program(module, name, stages, problem.t_begin);
  for (const Formula& formula : initial_formulas(problem)) program.keeps.push_back(formula.field);
}

bool is_control(const model::Problem& problem, const model::Unknown& unknown) {
  const model::Coefficient* coefficient = problem.find_coefficient(unknown.name);
  return unknown.kind == model::Unknown::Kind::coefficient && coefficient != nullptr && coefficient->is_control();
}

/// Names of fields may contain a dot, names of programs may not: programs are numbered.
std::ptrdiff_t number_of(const model::Problem& problem, const std::string& coefficient) {
  return std::ranges::find(problem.coefficients, coefficient, &model::Coefficient::name) -
         problem.coefficients.begin() + 1;
}

/// Formulas of coefficients before those of states, whose boundaries may read them.
std::vector<Formula> start_formulas(const Lowering& lowering, const model::Task& task) {
  std::vector<Formula> formulas;
  for (const model::Unknown& u : task.unknowns) {
    if (!u.is_field() || !u.from.formula || is_control(lowering.problem(), u)) continue;
    formulas.push_back({u.name, *u.from.formula, u.origin, lowering.placement_of(u.name)});
  }
  std::ranges::stable_partition(
      formulas, [&](const Formula& f) { return lowering.problem().find_coefficient(f.field) != nullptr; });
  return formulas;
}

void add_control_fields(Module& module, const Lowering& lowering, const ProgramNames& names) {
  const model::Problem& problem = lowering.problem();
  for (const model::Coefficient& c : problem.coefficients) {
    if (!c.is_control()) continue;
    if (c.value.formula)
      add_formulas(module, lowering, names.controls.at(c.name),
                   {{c.name, *c.value.formula, c.value.origin, c.placement}});
    const model::Unknown* u = problem.find_unknown(c);
    if (u == nullptr || !u->from.formula) continue;
    add_formulas(module, lowering, names.control_starts.at(c.name),
                 {{c.name, *u->from.formula, u->origin, c.placement}});
  }
}

std::vector<Formula> exact_formulas(const model::Problem& problem, Lowering& lowering) {
  std::vector<Formula> formulas;
  for (const model::State& s : problem.states) {
    if (s.exact)
      formulas.push_back({lowering.fresh_field(s.name + "_exact"), *s.exact, (*s.exact)->origin, s.placement});
  }
  return formulas;
}

std::vector<Formula> shown_formulas(const model::Problem& problem, Lowering& lowering) {
  std::vector<Formula> formulas;
  for (const model::OutputField& shown : problem.shown)
    formulas.push_back({lowering.fresh_field(shown.name + "_shown"), shown.value, shown.origin, shown.placement});
  return formulas;
}

/// Stores the initial guess of the next step's solve: the solution of the last stage that uses `guess`, or, for the
/// guess of a state `kept`, the state at the start of the step.
void keep_solution(Lowering& lowering, std::vector<Stage>& stages, const Advance& guess, const std::string& kept,
                   const std::string& name) {
  const bool is_of_state = lowering.problem().find_state(kept) != nullptr;
  for (auto stage = stages.rbegin(); stage != stages.rend() && !is_of_state; ++stage) {
    for (auto before = stage->before.rbegin(); before != stage->before.rend() && !stage->block; ++before) {
      const auto* solve = std::get_if<PreparedSolve>(&*before);
      if (solve == nullptr || std::ranges::count(solve->guesses, guess.state) == 0) continue;
      stage->kernel.stores.push_back({guess.into, false, access(solve->unknown), guess.origin});
      return;
    }
  }
  Kernel kernel = lowering.kernel(name + "_" + guess.state);
  kernel.stores.push_back({guess.into, false, access(is_of_state ? kept : guess.state), guess.origin});
  stages.push_back(Lowering::stage(std::move(kernel), lowering.discretiser()));
}

bool has_step(const model::Problem& problem) {
  const auto has_equation = [](const model::State& state) { return state.rhs || !state.history_of.empty(); };
  return problem.program.empty() && !problem.states.empty() && std::ranges::all_of(problem.states, has_equation);
}

/// An empty stage at the end of the step. Events follow it as stages of their own, which read the states there.
Stage end_of_step(const Lowering& lowering, const std::string& name, const FieldsOfStates& ends) {
  Environment reading;
  reading.fields = ends;
  reading.time = param("t") + param("dt");
  return Lowering::stage(lowering.kernel(name + "_end"), lowering.discretiser(reading), reading.time);
}

/// Adds the program of a step. `with_estimate`: with the error of an embedded pair. `watched`: null if nothing is.
Program& add_step(Module& module, Lowering& lowering, const std::string& name, bool with_estimate,
                  WatchedStages* watched = nullptr) {
  const model::Problem& problem = lowering.problem();
  std::vector<std::string> next;
  for (const model::State& state : problem.states) next.push_back(lowering.field_beside(state.name, "next"));
  std::vector<Advance> advances, guesses;
  for (std::size_t i = 0; i < problem.states.size(); ++i) {
    const model::State& state = problem.states[i];
    (state.is_guess ? guesses : advances).push_back({state.name, state.rhs.value_or(0.0), next[i], state.origin});
  }
  std::vector<Stage> stages = with_estimate ? stages_with_estimate(lowering, advances, name, problem.scene)
                                            : step_stages(lowering, advances, name);
  if (problem.scheme.dealias) stages = cut_to_two_thirds(lowering, std::move(stages));
  std::map<std::string, std::string> ends;
  for (std::size_t i = 0; i < next.size(); ++i) ends[problem.states[i].name] = next[i];
  BeforeEvent before;
  const std::size_t end = stages.size();
  if (watched != nullptr && !problem.events.empty()) {
    stages.push_back(end_of_step(lowering, name, ends));
    before = watched->before_events();
  }
  add_events(lowering, stages, ends, before);
  for (const Advance& guess : guesses)
    keep_solution(lowering, stages, guess, problem.find_state(guess.state)->history_of, name);
  if (watched != nullptr) stages = watched->behind(std::move(stages), end);
  Program& program = lowering.add_program(module, name, stages, param("t") + param("dt"));
  for (const model::State& state : problem.states) program.swaps.push_back({state.name, ends.at(state.name)});
  return program;
}

void add_step_and_loop(Module& module, Lowering& lowering, const std::string& name) {
  if (!has_step(lowering.problem())) return;
  add_step(module, lowering, name, false);
  Loop loop;
  loop.to = lowering.problem().steps;
  loop.programs = {name};
  module.loops.push_back(loop);
}

/// A named number and the name of its sum.
struct NamedValue {
  std::string sum;
  model::Expr value;
};

void add_sums(Module& module, const Lowering& lowering, const std::string& name,
              const std::vector<NamedValue>& values) {
  if (values.empty()) return;
  Discretiser at_point = lowering.discretiser();
  Kernel kernel = lowering.kernel(name);
  for (const NamedValue& v : values) kernel.sums.push_back({v.sum, cell_share(v.value, lowering.rank(), at_point)});
  lowering.add_program(module, name, {Lowering::stage(std::move(kernel), at_point)});
}

constexpr double rounding_of_states = 1e-3;  // weight of |u|/h in a constraint's size, of which 1e-6 is rounding

/// The residual of each constraint and the size of its terms.
std::vector<NamedValue> misses(const model::Problem& problem, const ProgramNames& names) {
  std::vector<NamedValue> values;
  const auto largest = [](const model::Expr& e) {  // numbers are linear in sums: a maximum is its own mean
    return model::reduce(model::Reduce::Kind::mean, model::reduce(model::Reduce::Kind::max, e));
  };
  const auto magnitude = [](const model::Expr& e) { return model::call(Fn::abs, {e}); };
  for (const model::Projection& projection : problem.projections) {
    if (!projection.potential) continue;
    model::Expr terms = 0.0;
    for (const model::Term& term : model::terms_of(projection.constraint))
      terms = model::binary(BinaryOp::add, terms, magnitude(term.value));
    const auto& [miss, sum] = names.misses[values.size() / 2];
    values.push_back({miss, largest(magnitude(projection.constraint))});
    model::Expr size = largest(terms);
    for (const model::Event::Update& update : projection.updates) {  // a size for uniform flows, whose terms are 0
      const model::Expr spacing = model::param("h" + problem.axes.front().name);
      const model::Expr rounding = model::binary(BinaryOp::divide, rounding_of_states, spacing);
      const model::Expr of_state = largest(magnitude(model::field(update.state)));
      size = model::binary(BinaryOp::add, size, model::binary(BinaryOp::multiply, rounding, of_state));
    }
    values.push_back({sum, size});
  }
  return values;
}

/// Operands of a spectrum or a correlation, each component at its placement.
std::vector<Formula> test_formulas(Lowering& lowering, const model::Test& test) {
  const model::Placements placements(lowering.problem());
  std::vector<Formula> formulas;
  for (const model::Expr& each : test.fields) {
    formulas.push_back({lowering.fresh_field(test.quantity.name + "_field"), each, test.quantity.origin,
                        placements.natural(each).value_or(model::Placement{})});
  }
  return formulas;
}

void add_task(Module& module, Lowering& lowering, const model::Task& task, const ProgramNames& names) {
  for (std::size_t i = 0; i < task.losses.size(); ++i) {
    add_sums(module, lowering, names.losses[i], {{"loss", task.losses[i].value}});
  }
  for (const model::Test& test : task.tests) {
    const model::Quantity& quantity = test.quantity;
    const std::string& name = names.tests.at(quantity.name);
    if (test.has_fields()) {
      add_formulas(module, lowering, name, test_formulas(lowering, test));
    } else {
      add_sums(module, lowering, name, {{quantity.name, quantity.value}});
    }
  }
}

}  // namespace

ProgramNames program_names(const model::Problem& problem) {
  NameSupply supply;
  if (!problem.program.empty()) supply.reserve(problem.program);
  const std::string& scene = problem.scene;
  ProgramNames names;
  names.coefficients = supply.fresh(scene + "_coefficients");
  names.initial = supply.fresh(scene + "_initial");
  names.step = problem.program.empty() ? supply.fresh(scene + "_step") : problem.program;
  names.trial = supply.fresh(scene + "_trial");
  names.rate = supply.fresh(scene + "_rate");
  names.exact = supply.fresh(scene + "_exact");
  names.observe = supply.fresh(scene + "_observe");
  names.shown = supply.fresh(scene + "_shown");
  names.constraints = supply.fresh(scene + "_constraints");
  NameSupply sums;
  for (const model::Parameter& parameter : problem.params) sums.reserve(parameter.name);
  for (const model::Projection& projection : problem.projections) {
    if (projection.potential)
      names.misses.emplace_back(sums.fresh(projection.multiplier + "_miss"),
                                sums.fresh(projection.multiplier + "_terms"));
  }
  for (const model::Coefficient& c : problem.coefficients) {
    if (c.is_control())
      names.controls[c.name] = supply.fresh(scene + "_control_" + std::to_string(number_of(problem, c.name)));
  }
  if (!problem.task) return names;
  const std::string& task = problem.task->name;
  names.start = supply.fresh(task + "_start");
  names.watched = supply.fresh(task + "_watched");
  names.watched_step = supply.fresh(task + "_watched_step");
  for (const auto& [field, program] : names.controls) {
    names.control_starts[field] = supply.fresh(task + "_control_" + std::to_string(number_of(problem, field)));
  }
  for (std::size_t i = 0; i < problem.task->losses.size(); ++i)
    names.losses.push_back(supply.fresh(task + "_loss_" + std::to_string(i + 1)));
  for (const model::Test& test : problem.task->tests)
    names.tests[test.quantity.name] = supply.fresh(task + "_test_" + test.quantity.name);
  return names;
}

Module from_model(const model::Problem& problem, const ProgramNames& names, DiagnosticSink& sink) {
  Module module;
  Lowering lowering(problem);
  if (!check(lowering, sink) || !check_stated_orders(problem, sink)) return module;
  check_idle_walls(lowering, sink);
  if (sink.has_errors()) return module;
  add_formulas(module, lowering, names.coefficients, coefficient_formulas(problem));
  add_initial(module, lowering, names.initial);
  if (problem.task) add_formulas(module, lowering, names.start, start_formulas(lowering, *problem.task));
  add_control_fields(module, lowering, names);
  Lowering same_names = lowering;
  add_step_and_loop(module, lowering, names.step);
  if (problem.substeps.control && has_step(problem)) add_step(module, same_names, names.trial, true);
  if (problem.substeps.rate)
    add_formulas(module, lowering, names.rate, {{names.rate_field, *problem.substeps.rate, problem.time_origin}});
  add_formulas(module, lowering, names.exact, exact_formulas(problem, lowering));
  std::vector<NamedValue> observables;
  for (const model::Quantity& o : problem.observables) observables.push_back({o.name, o.value});
  add_sums(module, lowering, names.observe, observables);
  add_formulas(module, lowering, names.shown, shown_formulas(problem, lowering));
  add_sums(module, lowering, names.constraints, misses(problem, names));
  if (problem.task) add_task(module, lowering, *problem.task, names);
  place_fills(module);
  return module;
}

Module program_of_values(const model::Problem& problem, const std::string& name,
                         const std::vector<model::Expr>& values) {
  Module module;
  Lowering lowering(problem);
  const model::Placements placements(problem);
  std::vector<Formula> formulas;
  for (const model::Expr& value : values)
    formulas.push_back({lowering.fresh_field(name + "_value"), value, value->origin,
                        placements.natural(value).value_or(model::Placement{})});
  add_formulas(module, lowering, name, formulas);
  place_fills(module);
  return module;
}

WatchedStep watched_step(const model::Problem& problem, const std::string& name,
                         const std::vector<WatchedValue>& values) {
  WatchedStep result;
  if (!has_step(problem) || values.empty()) return result;
  Lowering lowering(problem);
  WatchedStages watched(lowering, name, values);
  Program& program = add_step(result.module, lowering, name, problem.substeps.control.has_value(), &watched);
  result.marks = watched.marks();
  for (const SidesMarked& mark : result.marks) {
    for (const Swap& swap : mark.swaps) program.swaps.push_back(swap);
  }
  place_fills(result.module);
  return result;
}

}  // namespace dpde::stencil
