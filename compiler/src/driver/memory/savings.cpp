// SPDX-License-Identifier: Apache-2.0
#include "driver/memory/savings.h"

#include <algorithm>
#include <span>
#include <string>

#include "driver/scene/activity.h"
#include "model/print/print_model.h"

namespace dpde::driver {

namespace {

bool reads_states(const Compiled& compiled, const std::string& program) {
  const auto found = std::ranges::find(compiled.loop.programs, program, &loop::Program::name);
  if (found == compiled.loop.programs.end()) return false;
  const auto inputs = std::span(found->fields).first(static_cast<std::size_t>(found->input_count));
  return std::ranges::any_of(inputs,
                             [&](const std::string& field) { return compiled.problem->find_state(field) != nullptr; });
}

/// First time at which a loss is evaluated.
double begin_of(const model::When& when, const model::Problem& problem) {
  const double end = problem.t_begin + problem.steps * problem.step;
  if (when.kind == model::When::Kind::over) return problem.t_begin;
  if (when.kind == model::When::Kind::steps && when.is_last) return end;
  if (when.kind == model::When::Kind::steps) return problem.t_begin + problem.step;
  return when.kind == model::When::Kind::end || when.times.empty() ? end : *std::ranges::min_element(when.times);
}

double end_of(const model::When& when, const model::Problem& problem) {
  const double end = problem.t_begin + problem.steps * problem.step;
  return when.kind != model::When::Kind::at || when.times.empty() ? end : *std::ranges::max_element(when.times);
}

double last_loss(const model::Problem& problem) {
  double last = problem.t_begin;
  for (const model::Loss& loss : problem.task->losses) last = std::max(last, end_of(loss.when, problem));
  return last;
}

/// "" if the step has no adjoint.
std::string adjoint_of_step(const Compiled& compiled) {
  const auto derived = compiled.derived.find(compiled.step_name());
  return derived == compiled.derived.end() || !derived->second.adjoint ? "" : derived->second.adjoint->program;
}

/// Whether the full problem equals the compiled one, and has the same variables of differentiation.
bool is_in_full(const Compiled& compiled, const CompileOptions& full) {
  DiagnosticSink silent;
  const auto own = model::from_ast(compiled.ast, compiled.options.selection, silent),
             whole = model::from_ast(compiled.ast, full.selection, silent);
  if (!own || !whole || print(*own) != print(*whole)) return false;
  const adjoint::Activity all = activity_of(compiled, full);
  const bool has_all =
      compiled.options.adjoint && all.fields == compiled.activity.fields && all.params == compiled.activity.params;
  return !compiled.problem->task || has_all;
}

}  // namespace

bool reads_states_back(const Compiled& compiled) { return reads_states(compiled, adjoint_of_step(compiled)); }

bool keeps_states(const Compiled& compiled) {
  const model::Problem& problem = *compiled.problem;
  if (reads_states_back(compiled) || reads_states(compiled, compiled.names.rate)) return true;
  const std::vector<model::Loss>& losses = problem.task->losses;
  const double last = last_loss(problem);
  for (std::size_t i = 0; i < losses.size(); ++i) {
    const auto derived = compiled.derived.find(compiled.names.losses[i]);
    if (derived == compiled.derived.end() || !derived->second.adjoint) continue;
    if (begin_of(losses[i].when, problem) < last && reads_states(compiled, derived->second.adjoint->program))
      return true;
  }
  return false;
}

Traffic traffic_of(const Compiled& compiled) {
  Traffic traffic{cost_of(compiled.loop, compiled.step_name()).bytes, {}, {}};
  const auto derived = compiled.derived.find(compiled.step_name());
  if (!compiled.problem->task || derived == compiled.derived.end() || !derived->second.adjoint) return traffic;
  const std::string& adjoint = derived->second.adjoint->program;
  traffic.adjoint = cost_of(compiled.loop, adjoint).bytes;
  const double state = bytes_of(compiled.real()) * static_cast<double>(compiled.problem->states.size());
  traffic.stored = keeps_states(compiled) ? state : 0;
  return traffic;
}

std::optional<Traffic> traffic_in_full(const SourceFile& source, const Compiled& compiled) {
  CompileOptions options = compiled.options;
  options.selection.keeps_params = true;
  options.by_everything = true;
  options.backend.reset();
  options.after = {};
  if (is_in_full(compiled, options)) return traffic_of(compiled);
  for (const bool adjoint : {true, false}) {
    DiagnosticSink silent;  // errors of the scene were reported before
    options.adjoint = adjoint && compiled.problem->task;
    const std::optional<Compiled> full = compile(source, options, silent);
    if (full && full->problem) return traffic_of(*full);
  }
  return std::nullopt;
}

}  // namespace dpde::driver
