// SPDX-License-Identifier: Apache-2.0
#include "driver/memory/storage.h"

#include <algorithm>
#include <cmath>

#include "codegen/program_table.h"
#include "driver/compile/links.h"
#include "driver/memory/cost.h"
#include "support/assert.h"

namespace dpde::driver {

namespace {

constexpr std::int64_t least_budget = std::int64_t{1} << 26;

/// nullptr if the program has no adjoint.
const dpde_program* adjoint_in(const codegen::ProgramTables& tables, const Compiled& compiled,
                               const std::string& program) {
  const auto derived = compiled.derived.find(program);
  return derived == compiled.derived.end() || !derived->second.adjoint ? nullptr
                                                                       : tables.find(derived->second.adjoint->program);
}

bool add_losses(const codegen::ProgramTables& tables, const Compiled& compiled, RolloutSetup& setup) {
  const model::Problem& problem = *compiled.problem;
  for (std::size_t i = 0; i < problem.task->losses.size(); ++i) {
    const std::string& name = compiled.names.losses[i];
    LossTerm term;
    term.loss = tables.find(name);
    term.adjoint = adjoint_in(tables, compiled, name);
    const model::Loss& loss = problem.task->losses[i];
    if (!loss.of_averages) term.at_steps = steps_of(loss.when, problem, problem.steps);
    term.average = loss.average;
    term.of_averages = loss.of_averages;
    if (term.loss == nullptr || (term.adjoint == nullptr && loss.average.empty())) return false;
    setup.losses.push_back(std::move(term));
  }
  return true;
}

/// For memory plans only: contains just the parts of the set-up that need memory.
RolloutSetup setup_of_run(const codegen::ProgramTables& tables, const Compiled& compiled) {
  RolloutSetup setup;
  setup.step = tables.find(compiled.step_name());
  setup.rate = tables.find(compiled.names.rate);
  if (setup.rate != nullptr) {
    setup.courant = compiled.problem->courant;
    setup.rate_field = compiled.names.rate_field;
  }
  setup.trial = tables.find(compiled.names.trial);
  if (setup.trial != nullptr) setup.first_part = compiled.problem->step_control->first;
  setup.layout = layout_of(compiled);
  setup.steps = compiled.problem->steps;
  setup.steady = compiled.problem->steady;
  return setup;
}

}  // namespace

std::int64_t budget_of_states(const StorageOptions& options) {
  if (!options.checkpoint_folder.empty()) return options.checkpoint_bytes;
  return std::min(options.checkpoint_bytes, std::max(available_memory() / 2, least_budget));
}

std::vector<int> steps_of(const model::When& when, const model::Problem& problem, int run_steps) {
  std::vector<int> steps;
  switch (when.kind) {
    case model::When::Kind::end: steps.push_back(run_steps); break;
    case model::When::Kind::at:
      for (const double t : when.times) {
        const double position = std::round((t - problem.t_begin) / problem.step);
        steps.push_back(static_cast<int>(std::clamp(position, 0.0, static_cast<double>(run_steps))));
      }
      std::sort(steps.begin(), steps.end());
      steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
      break;
    case model::When::Kind::over:
      for (int k = 0; k <= run_steps; ++k) steps.push_back(k);
      break;
    case model::When::Kind::steps:
      for (int k = when.is_last ? std::min(when.count, run_steps) : 1; k <= std::min(when.count, run_steps); ++k)
        steps.push_back(k);
      break;
  }
  return steps;
}

GradientPlan plan_of_rollout(const Compiled& compiled) {
  const codegen::ProgramTables tables(compiled.loop, {}, nullptr);
  return plan_gradient(setup_of_run(tables, compiled));
}

GradientPlan plan_of_watched_run(const Compiled& compiled) {
  const codegen::ProgramTables tables(compiled.loop, {}, nullptr);
  RolloutSetup setup = setup_of_run(tables, compiled);
  setup.step = tables.find(compiled.names.watched_step);
  if (setup.step == nullptr) return {};
  if (setup.trial != nullptr) setup.trial = setup.step;
  setup.steady = 0;
  return plan_gradient(std::move(setup));
}

std::optional<GradientPlan> plan_of_gradient(const Compiled& compiled, const StorageOptions& options) {
  const model::Problem& problem = *compiled.problem;
  codegen::ProgramTables tables(compiled.loop, {}, nullptr);
  for (const LinkedProgram& derivative : linked_programs(compiled))
    tables.set_links(derivative.program, derivative.links);
  RolloutSetup setup = setup_of_run(tables, compiled);
  setup.adjoint = adjoint_in(tables, compiled, compiled.step_name());
  for (const AdjointVariant& variant : compiled.variants) {
    setup.adjoint_variants.push_back({tables.find(variant.adjoint), tables.find(variant.step)});
    require(setup.adjoint_variants.back().adjoint != nullptr, "a variant has its adjoint");
    require(variant.step.empty() || setup.adjoint_variants.back().step != nullptr, "a variant has its step");
  }
  setup.team = options.threads;
  setup.checkpoint_bytes = budget_of_states(options);
  if (setup.adjoint == nullptr || !add_losses(tables, compiled, setup)) return std::nullopt;
  for (const model::Coefficient& coefficient : problem.coefficients) {
    if (coefficient.is_control())
      setup.control_fields.push_back(
          {coefficient.name, coefficient.every,
           std::vector<void*>(static_cast<std::size_t>(problem.intervals(coefficient.every)))});
    if (compiled.activity.fields.contains(coefficient.name)) setup.sought.push_back(coefficient.name);
  }
  return plan_gradient(std::move(setup));
}

}  // namespace dpde::driver
