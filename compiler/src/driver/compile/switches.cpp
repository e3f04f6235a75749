// SPDX-License-Identifier: Apache-2.0
#include "driver/compile/switches.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "adjoint/rules.h"
#include "model/analyse/solves.h"
#include "model/build.h"
#include "model/print/print_model.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/lower/jumps.h"
#include "stencil/lower/unread_boundaries.h"
#include "stencil/passes/passes.h"

namespace dpde::driver {

namespace {

std::string name_of(const model::Unknown& unknown) {
  return unknown.kind == model::Unknown::Kind::initial ? "initial " + unknown.name : unknown.name;
}

/// Reports a floor of an unknown: it jumps, and its derivative is 0 elsewhere.
void report_floor(const SourceRange& range, const std::string& further, DiagnosticSink& sink) {
  sink.report("no-useful-derivative", range, {"floor", "here"},
              "its derivative is 0 almost everywhere; write the smooth function you mean, or take its argument from "
              "what is not an unknown" +
                  further);
}

void report(const model::Task& task, const model::OnlySwitching& found, DiagnosticSink& sink) {
  const model::Unknown& unknown = task.unknowns[found.unknown];
  const SourceRange range = found.origin.range.is_known() ? found.origin.range : unknown.origin.range;
  if (found.sets_length) {
    sink.report("switch-without-derivative", range,
                {name_of(unknown), "it sets how long steps are, and the gradient by it would be 0"},
                "steps have no derivative by how long they are: take it out of the unknowns of task " + task.name);
    return;
  }
  if (found.what == name_of(Fn::floor)) return report_floor(range, "", sink);
  sink.report("switch-without-derivative", range, {name_of(unknown), "the gradient by it would be 0"},
              fmt::format("write a smooth switch whose width the steps and cells resolve, as 0.5 + 0.5*tanh((b - a)/w) "
                          "for if(a < b, 1, 0), or take {} out of the unknowns of task {}",
                          name_of(unknown), task.name));
}

/// Explains the jump for a message.
std::string why_of(const model::Jump& jump) {
  const std::string moved = fmt::format("{}", fmt::join(jump.movers, " and "));
  return jump.is_at_pole     ? "as " + moved + " moves, this divides by 0 and jumps"
         : jump.what.empty() ? "the branches of this choice do not meet where it switches, and " + moved + " moves it"
                             : jump.what + " jumps as " + moved + " moves";
}

constexpr const char* forced = "; --force goes on without the jump";
constexpr const char* smooth_at_pole =
    "write a smooth function whose width the steps and cells resolve, as z/sqrt(z^2 + w^2) for z/abs(z)";

/// Advice: a smooth formula to use instead.
std::string smooth_for(const model::Jump& jump) {
  if (jump.is_at_pole) return smooth_at_pole;
  return "let the branches have one value where it switches, or write a smooth switch, as "
         "a + (b - a)*(0.5 + 0.5*tanh((s - s0)/w)) for if(s < s0, a, b)";
}

void report(const model::Jump& jump, DiagnosticSink& sink) {
  if (jump.what == name_of(Fn::floor)) return report_floor(jump.origin.range, forced, sink);
  sink.report("branches-do-not-meet", jump.origin.range, {why_of(jump)}, smooth_for(jump) + forced);
}

std::vector<stencil::Kernel> kernels_of(const stencil::Module& module, const stencil::Program& program) {
  std::vector<stencil::Kernel> kernels;
  for (const std::string& name : stencil::parts_of({program}).kernels) kernels.push_back(*module.find_kernel(name));
  return kernels;
}

/// Names that a hand-written step reads. A parameter by which no kernel value has a derivative is read by switches
/// only.
model::NamesRead names_read(const stencil::Module& module, const stencil::Program& program) {
  const stencil::Interface interface = stencil::interface_of(module, program);
  model::NamesRead reading;
  reading.smooth.insert(interface.inputs.begin(), interface.inputs.end());
  reading.smooth.insert(interface.networks.begin(), interface.networks.end());
  reading.any = reading.smooth;
  const std::vector<stencil::Kernel> kernels = kernels_of(module, program);
  for (const std::string& param : interface.params) {
    reading.any.insert(param);
    bool is_read = false, is_smooth = false;
    for (const stencil::Kernel& kernel : kernels) {
      adjoint::Varied varied{{}, {param}, {}};
      varied.locals = adjoint::varied_locals(kernel, varied);
      for_each_expression(kernel, [&](const stencil::Expr& value) {
        is_read = is_read || reads_param(value, param);
        is_smooth = is_smooth || adjoint::is_varied(value, varied);
      });
    }
    if (is_smooth || !is_read) reading.smooth.insert(param);  // not read by kernels: a weight of a boundary condition
  }
  return reading;
}

/// First jump in the kernels of a hand-written step. Intermediate fields of its kernels count as varying.
std::optional<model::Jump> jump_of_program(const Compiled& compiled, const stencil::Program& program,
                                           const model::Influence& influence, model::Signs signs) {
  const model::Problem& problem = *compiled.problem;
  const stencil::Interface interface = stencil::interface_of(compiled.stencil, program);
  const auto is_given = [&](const std::string& name) {
    return std::ranges::find(interface.inputs, name) != interface.inputs.end() ||
           std::ranges::find(interface.params, name) != interface.params.end();
  };
  const auto moves = [&](const std::string& name) { return !is_given(name) || !influence.on(name).any.empty(); };
  const stencil::Movement movement{moves,
                                   [&](const std::string& name) {
                                     Piecewise::Symbol symbol = model::range_of(problem, name);
                                     symbol.moves = moves(name);
                                     return symbol;
                                   },
                                   signs == model::Signs::kept};
  for (const stencil::Kernel& kernel : kernels_of(compiled.stencil, program)) {
    const std::optional<stencil::KernelJump> found = stencil::jump_in(kernel, movement);
    if (found)
      return model::Jump{
          {found->range}, found->what, {found->movers.begin(), found->movers.end()}, "", found->is_at_pole};
  }
  return std::nullopt;
}

/// The step if it is hand-written, else nullptr.
const stencil::Program* written_step(const Compiled& compiled) {
  return compiled.problem->program.empty() ? nullptr : compiled.stencil.find_program(compiled.step_name());
}

/// The program in its own module, without code that is only needed for initial guesses of solves.
stencil::Module without_guesses(const stencil::Module& module, const stencil::Program& program) {
  stencil::Module alone = module;
  alone.programs = {program};
  stencil::forget_guesses(alone.programs.front().body);
  return stencil::remove_dead_code(alone);
}

/// Names that a hand-written step reads only for initial guesses of solves.
std::set<std::string> names_in_guesses(const stencil::Module& module, const stencil::Program& program) {
  const stencil::Module alone = without_guesses(module, program);
  const model::NamesRead all = names_read(module, program), rest = names_read(alone, alone.programs.front());
  std::set<std::string> names;
  std::ranges::set_difference(all.any, rest.any, std::inserter(names, names.end()));
  return names;
}

model::Influence influence_in(const Compiled& compiled) {
  const stencil::Program* step = written_step(compiled);
  if (step == nullptr) return model::Influence(*compiled.problem, {});
  const stencil::Module alone = without_guesses(compiled.stencil, *step);
  return model::Influence(*compiled.problem, names_read(alone, alone.programs.front()));
}

/// Jumps in the scene's formulas. Walls whose values nothing reads are excluded; they have a warning of their own.
/// Finding these takes a lowering, so it is done only if there are jumps.
std::vector<model::Jump> jumps_of_formulas(const Compiled& compiled, const model::Influence& influence,
                                           model::Signs signs) {
  const model::Problem& problem = *compiled.problem;
  const std::vector<model::Jump> jumps = model::jumps_of(problem, influence, signs);
  const bool has_walls =
      std::ranges::any_of(problem.axes, [](const model::Axis& axis) { return axis.topology == Topology::bounded; });
  if (jumps.empty() || !has_walls) return jumps;
  return model::jumps_of(stencil::without_idle_walls(problem), influence, signs);
}

std::vector<model::Jump> jumps_by(const Compiled& compiled, const model::Influence& influence, model::Signs signs) {
  std::vector<model::Jump> jumps = jumps_of_formulas(compiled, influence, signs);
  const stencil::Program* step = written_step(compiled);
  std::optional<model::Jump> of_step = step ? jump_of_program(compiled, *step, influence, signs) : std::nullopt;
  if (of_step) jumps.push_back(std::move(*of_step));
  return jumps;
}

/// Whether only parameters move the jump. A scene without a task need not treat them as unknowns.
bool is_by_parameters(const model::Problem& problem, const model::Jump& jump) {
  return std::ranges::all_of(jump.movers, [&](const std::string& name) { return problem.find_param(name) != nullptr; });
}

/// Whether runs check the switch, instead of an error now. They can if states move it.
bool is_watched(const model::Problem& problem, const model::Jump& jump, const CompileOptions& options) {
  const bool has_windows = problem.task && problem.task->training;  // start from data, whose states may be on any side
  const bool is_once = jump.in.loss && problem.task->losses[*jump.in.loss].of_averages;  // evaluated once in a run
  return jump.side && !is_once && !options.trusts_signs && !has_windows && !is_by_parameters(problem, jump);
}

}  // namespace

bool may_jump(const Compiled& compiled) {
  return compiled.problem && compiled.problem->task &&
         !jumps_by(compiled, influence_in(compiled), model::Signs::any).empty();
}

void report_jumps_left_out(const Compiled& compiled, DiagnosticSink& sink) {
  for (const model::Jump& jump : compiled.jumps_left_out) report(jump, sink);
}

void warn_of_jumps_left_out(const Compiled& compiled, DiagnosticSink& sink) {
  for (const model::Jump& jump : compiled.jumps_left_out)
    sink.report("jump-left-out", jump.origin.range, {why_of(jump)}, smooth_for(jump));
}

void warn_of_unwatched(const Compiled& compiled, DiagnosticSink& sink) {
  for (const Origin& origin : compiled.unwatched)
    sink.report("jump-left-out", origin.range, {"this jumps where it divides by 0, and no run looks whether it does"},
                "dpde verify looks for jumps beside the point where a task begins");
}

void warn_of_watched(const Compiled& compiled, DiagnosticSink& sink) {
  for (const Watched& watched : compiled.watched) {
    if (watched.is_switch)
      sink.report("jump-left-out", watched.origin.range, {watched.text + " may switch in the run"},
                  "gradients look whether it does; if so, " + watched.help);
  }
}

/// Reports unknowns that act on losses only through initial guesses of solves. Solutions do not depend on these, so the
/// gradient would be 0.
void check_guesses(const Compiled& compiled, const model::Influence& influence, DiagnosticSink& sink) {
  const model::Task& task = *compiled.problem->task;
  model::Influence::Unknowns begun_with;
  const auto add = [&](const model::NamesRead& reading) {
    const model::Influence::Unknowns reached = influence.on(reading).any;
    begun_with.insert(reached.begin(), reached.end());
  };
  for (const model::Solve* solve : model::solves_of(*compiled.problem)) {
    for (const model::Expr& start : solve->starts) add(model::names_read(start));
    if (solve->preconditioner) add(model::names_read(*solve->preconditioner));
  }
  if (const stencil::Program* step = written_step(compiled)) add({{}, names_in_guesses(compiled.stencil, *step)});
  for (const std::size_t i : begun_with) {
    if (influence.on_losses().any.contains(i)) continue;
    const model::Unknown& unknown = task.unknowns[i];
    sink.report("no-useful-derivative", unknown.origin.range,
                {name_of(unknown),
                 "acts on what a solve begins with or is preconditioned by alone, on which no solution depends: it"},
                "minimise what a guess leaves, as mean((lap(q) + w)^2) with solve lap(q) = -w for q from guess(w) "
                "after 0 iterations, or what it or a preconditioner leaves after 5 iterations");
  }
}

void check_switches(Compiled& compiled, const CompileOptions& options, DiagnosticSink& sink) {
  if (!compiled.problem || !compiled.problem->task || options.by_everything) return;
  const model::Problem& problem = *compiled.problem;
  const model::Task& task = *problem.task;
  const model::Influence influence = influence_in(compiled);
  for (const model::OnlySwitching& found : only_switching(problem, influence)) {
    const model::Unknown& unknown = task.unknowns[found.unknown];
    if (!task.certifies) report(task, found, sink);
    if (task.certifies && unknown.kind != model::Unknown::Kind::initial) compiled.activity.params.erase(unknown.name);
  }
  if (!task.certifies) check_guesses(compiled, influence, sink);
  if (sink.has_errors()) return;
  for (const model::Jump& jump : jumps_by(compiled, influence, model::Signs::kept)) {
    if (task.certifies && is_by_parameters(problem, jump)) {
      for (const std::string& mover : jump.movers) compiled.activity.params.erase(mover);
    } else if (is_watched(problem, jump, options)) {
      continue;
    } else if (options.takes_jumps) {
      compiled.jumps_left_out.push_back(jump);
    } else {
      report(jump, sink);
    }
  }
}

namespace {

/// A value to check, and the only places it occurs in: equations of these states and events of each step (neither: also
/// elsewhere), or one event.
struct ValueToWatch {
  model::Expr value;
  Watched watched;
  std::set<std::string> equations;
  bool is_in_each_step = false;
  std::optional<std::size_t> event = {};
  bool stands_elsewhere() const { return equations.empty() && !is_in_each_step; }
};
using ValuesToWatch = std::vector<ValueToWatch>;

/// A value in several losses is checked for each of them; a value of the run is checked at all states.
void add_watched(ValueToWatch added, ValuesToWatch& values) {
  for (ValueToWatch& known : values) {
    const bool is_of_another_loss =
        added.watched.loss > 0 && known.watched.loss > 0 && added.watched.loss != known.watched.loss;
    if (known.value != added.value || known.watched.is_switch != added.watched.is_switch || is_of_another_loss ||
        known.event != added.event)
      continue;
    if (added.watched.loss > 0) return;
    if (added.stands_elsewhere() || (known.watched.loss == 0 && known.stands_elsewhere())) {
      known.equations.clear();
      known.is_in_each_step = false;
    } else {
      known.equations.merge(added.equations);
      known.is_in_each_step = known.is_in_each_step || added.is_in_each_step;
    }
    known.watched = added.watched;
    return;
  }
  values.push_back(std::move(added));
}

/// A switch in an event matters only at the times of the event. A divisor on a grid matters always: its signs since the
/// beginning show how its zeros have moved between cells.
std::optional<std::size_t> event_alone(const model::Problem& problem, const model::FormulaPlace& in,
                                       const Watched& watched) {
  const bool is_one_cell = std::ranges::all_of(problem.axes, [](const model::Axis& axis) { return axis.cells == 1; });
  return watched.is_switch || is_one_cell ? in.event : std::nullopt;
}

/// Sides of checked jumps, and divisors that formulas assume to keep their sign.
ValuesToWatch values_to_watch(Compiled& compiled, const CompileOptions& options) {
  const model::Problem& problem = *compiled.problem;
  const model::Influence influence = influence_in(compiled);
  ValuesToWatch values;
  const auto add = [&](const model::Expr& value, const model::FormulaPlace& in, Watched watched) {
    watched.loss = in.loss ? static_cast<int>(*in.loss) + 1 : 0;
    const std::set<std::string> equations = in.equation.empty() ? std::set<std::string>() : std::set{in.equation};
    const std::optional<std::size_t> event = event_alone(problem, in, watched);
    add_watched({value, std::move(watched), equations, in.is_in_each_step, event}, values);
  };
  for (const model::Jump& jump : jumps_of_formulas(compiled, influence, model::Signs::kept)) {
    if (!is_watched(problem, jump, options)) continue;
    const std::string what = jump.what.empty() ? "this choice, whose branches do not meet," : "this " + jump.what;
    add(*jump.side, jump.in, {"", what, smooth_for(jump) + forced, jump.origin, true});
  }
  for (const model::Divisor& divisor : trusted_divisors(problem, influence)) {
    const bool is_number = divisor.in.loss && problem.task->losses[*divisor.in.loss].of_averages;
    if (is_number) continue;  // a formula of numbers jumps only at its pole
    if (!divisor.value || options.trusts_signs) {
      const auto is_it = [&](const Origin& origin) { return origin.range == divisor.origin.range; };
      if (std::ranges::none_of(compiled.unwatched, is_it)) compiled.unwatched.push_back(divisor.origin);
      continue;
    }
    add(*divisor.value, divisor.in,
        {"", "this divides by " + print(*divisor.value) + ", which", std::string(smooth_at_pole) + forced,
         divisor.origin, false, divisor.begins_with_one_sign});
  }
  return values;
}

/// Program that evaluates the values in the stages of each step.
stencil::Module watch_steps(Compiled& compiled, const ValuesToWatch& values) {
  std::vector<stencil::WatchedValue> of_steps;
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i].watched.loss > 0) continue;
    of_steps.push_back({values[i].value, values[i].equations, values[i].is_in_each_step, values[i].event});
    numbers.push_back(i);
  }
  stencil::WatchedStep step = stencil::watched_step(*compiled.problem, compiled.names.watched_step, of_steps);
  for (std::size_t i = 0; i < step.marks.size(); ++i) {
    Watched& watched = compiled.watched[numbers[i]];
    watched.below = step.marks[i].below;
    watched.above = step.marks[i].above;
  }
  return std::move(step.module);
}

}  // namespace

std::vector<stencil::Module> watch_jumps(Compiled& compiled, const CompileOptions& options) {
  if (!compiled.problem || !compiled.problem->task || options.by_everything) return {};
  const ValuesToWatch values = values_to_watch(compiled, options);
  const stencil::Program* step = written_step(compiled);
  if (step != nullptr) {
    const auto jump = [&](model::Signs signs) {
      return jump_of_program(compiled, *step, influence_in(compiled), signs);
    };
    const std::optional<model::Jump> found = jump(model::Signs::any);
    if (found && found->is_at_pole && !jump(model::Signs::kept)) compiled.unwatched.push_back(found->origin);
  }
  if (values.empty()) return {};
  std::vector<model::Expr> formulas;
  // A value used only by an event is not checked at states, where its sign may change.
  for (const ValueToWatch& one : values) formulas.push_back(one.event ? model::number(1) : one.value);
  stencil::Module module = stencil::program_of_values(*compiled.problem, compiled.names.watched, formulas);
  for (std::size_t i = 0; i < values.size(); ++i) {
    compiled.watched.push_back(values[i].watched);
    compiled.watched.back().field = module.programs.front().keeps[i];
  }
  stencil::Module steps = watch_steps(compiled, values);
  return {std::move(module), std::move(steps)};
}

}  // namespace dpde::driver
