// SPDX-License-Identifier: Apache-2.0
#include "stability/step/linear_step.h"

#include <algorithm>
#include <utility>

#include "adjoint/reverse/plan.h"
#include "stability/frozen/frozen_evaluation.h"
#include "stability/report/known_networks.h"
#include "stability/step/coupled_means.h"
#include "stability/step_capabilities.h"
#include "stencil/passes/displaced_values.h"
#include "stencil/passes/passes.h"
#include "support/contains.h"

namespace dpde::stability {

using namespace stencil;

std::optional<LinearStep> LinearStep::make(const Module& given, const std::string& step, std::string& why,
                                           bool of_constraints, const StateGroup& group) {
  const Module module = with_values_in_place(given);
  const Program* program = module.find_program(step);
  if (program == nullptr || program->swaps.empty()) {
    why = "the program has no states";
    return std::nullopt;
  }
  if (program->swaps.size() > most_states) {
    why = "it has too many states";
    return std::nullopt;
  }
  adjoint::Activity states;
  for (const Swap& swap : program->swaps) {
    if (is_in(group, swap.state)) states.fields.insert(swap.state);
  }
  DiagnosticSink sink;
  adjoint::Derivative tangent = adjoint::tangent(module, step, states, sink);
  if (sink.has_errors()) {
    why = "it has no tangent";
    return std::nullopt;
  }
  LinearStep result;
  for (const Swap& swap : program->swaps) {
    if (!states.fields.contains(swap.state)) continue;
    const std::string *before = tangent.field(swap.state), *behind = tangent.field(swap.next);
    result.states_.push_back(swap.state);
    result.perturbations_.push_back(before == nullptr ? "" : *before);
    result.results_.push_back(behind == nullptr ? "" : *behind);
  }
  Program& derived = tangent.module.programs.front();
  std::erase_if(derived.swaps, [&](const Swap& swap) { return !contains(result.perturbations_, swap.state); });
  derived.keeps.clear();
  for (const adjoint::Link& link : tangent.links) {
    if (link.kind != adjoint::Link::Kind::field) continue;
    result.varied_.insert(link.primal);
    result.rates_.insert(link.derived);
  }
  adjoint::Activity all;  // of all states: a field that the step changes is known only at its start
  for (const Swap& swap : program->swaps) all.fields.insert(swap.state);
  result.varied_.merge(adjoint::find_varied(module, *program, all).fields);
  std::set<std::string> known;
  result.module_ = remove_dead_code(without_known_networks(without_guesses(tangent.module), known));
  Module uncoupled = without_coupled_means(result.module_, result.rates_);
  if (!(uncoupled == result.module_))
    result.coupled_ = std::exchange(result.module_, remove_dead_code(std::move(uncoupled)));
  StepCapabilities found;
  survey(result.module_, result.program().body, found);
  result.follows_flow_ = found.is_semi_lagrangian;
  result.reduces_ = found.reduces || result.couples_means();
  result.solves_ = found.solves;
  result.has_networks_ = found.has_networks;
  result.of_constraints_ = of_constraints;
  result.find_inputs(known);
  why = found.why;
  if (why.empty())
    result.kernels_ = std::make_shared<const FrozenKernels>(result.module_, result.varied_, result.rates_);
  return why.empty() ? std::optional(std::move(result)) : std::nullopt;
}

LinearStep LinearStep::with_all_coupled() const {
  LinearStep result = *this;
  result.coupled_ = coupled_module();
  result.module_ = remove_dead_code(without_means(coupled_module(), rates_));
  result.kernels_ = std::make_shared<const FrozenKernels>(result.module_, varied_, rates_);
  return result;
}

void LinearStep::find_inputs(const std::set<std::string>& of_networks) {
  const Module& whole = coupled_module();
  for (const std::string& input : interface_of(whole, whole.programs.front()).inputs) {
    if (!contains(perturbations_, input)) inputs_.push_back(input);
    if (of_networks.contains(input)) known_networks_.insert(input);
  }
}

bool LinearStep::is_rational_in_step(const FrozenStages& stages) const {
  return kernels_->is_rational_in_step() &&
         std::ranges::all_of(stages, [](const auto& stage) { return stage.has_value(); });
}

std::optional<LinearisedStep> LinearStep::response(const FrozenPoint& point, double dt) const {
  FrozenStages stages;
  return response(point, dt, stages);
}

std::optional<LinearisedStep> LinearStep::response(const FrozenPoint& point, double dt, FrozenStages& stages) const {
  Evaluation evaluation(*kernels_, varied_, rates_, point, dt, stages, of_constraints_);
  for (std::size_t s = 0; s < states_.size(); ++s) {
    if (!perturbations_[s].empty()) evaluation.perturb(perturbations_[s], static_cast<int>(s));
  }
  evaluation.run(program().body);
  if (evaluation.is_too_far()) return std::nullopt;
  LinearisedStep response;
  for (const std::string& result : results_)
    response.rows.push_back(result.empty() ? LinearForm() : evaluation.at(result).form);
  response.waves = evaluation.take_waves();
  response.displacement = evaluation.displacement();
  const bool is_finite = std::ranges::all_of(response.rows, &LinearForm::is_finite) &&
                         std::ranges::all_of(response.waves, &WaveSum::is_finite);
  return is_finite ? std::optional(std::move(response)) : std::nullopt;
}

}  // namespace dpde::stability
