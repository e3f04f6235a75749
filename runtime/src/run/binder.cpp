// SPDX-License-Identifier: Apache-2.0
#include "run/binder.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "dpde/runtime/error.h"
#include "dpde/runtime/links.h"

namespace dpde {
namespace {

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::ranges::any_of(names, [&](const std::string& other) { return other == name; });
}

/// Whether it is what a loss weighs, which the rollout sets.
bool is_seed(const dpde_program& program, int param) {
  return std::ranges::any_of(links_of(program), [&](const dpde_link& link) {
    return link.kind == DPDE_LINK_SUM && link.derived_kind == DPDE_LINK_PARAM && link.derived == param;
  });
}

}  // namespace

void Binder::bind_params(BoundProgram& bound) const {
  const dpde_program& program = bound.executor.program();
  for (int p = 0; p < program.param_count; ++p) {
    const std::string_view name = program.params[p];
    if (name == "t" || is_seed(program, p)) continue;
    if (name == "dt") {  // what the caller binds under that name is not asked
      bound.executor.set_param(p, setup_.dt);
      continue;
    }
    if (contains(averages_, name)) continue;
    const auto found = std::ranges::find(setup_.params, name, &BoundParam::name);
    if (found == setup_.params.end()) throw_not_bound(program, "parameter", name);
    bound.executor.set_param(p, found->value);
  }
  bound.t_param = bound.executor.param_index("t");
  bound.dt_param = bound.executor.param_index("dt");
}

/// Binds the caller's fields; whatever else is not computed by the program and not in own is missing.
void Binder::bind_inputs(BoundProgram& bound, const std::vector<std::string>& own) {
  const dpde_program& program = bound.executor.program();
  std::vector<int> temporaries;
  for (int f = 0; f < program.field_count; ++f) {
    const std::string_view name = program.fields[f];
    if (contains(own, name)) continue;
    const auto found = std::ranges::find(setup_.fields, name, &BoundField::name);
    if (f >= program.input_count) {
      temporaries.push_back(f);
    } else if (memory_.is_plan()) {
      continue;
    } else if (found == setup_.fields.end() || found->base == nullptr) {
      throw_not_bound(program, "field", name);
    } else {
      bound.executor.bind(f, found->base);
      if (bound.executor.prepares(f)) bound.fill_inputs.push_back(f);
      const auto control = std::ranges::find(setup_.control_fields, name, &ControlField::name);
      if (control != setup_.control_fields.end())
        bound.control_fields.emplace_back(f, control - setup_.control_fields.begin());
    }
  }
  bound.temporaries = memory_.pool(setup_.layout, static_cast<int64_t>(temporaries.size()));
  if (memory_.is_plan()) return;
  for (size_t i = 0; i < temporaries.size(); ++i)
    bound.executor.bind(temporaries[i], bound.temporaries.base(static_cast<int64_t>(i)));
}

/// own: fields that the caller of this function binds itself (beside the states).
BoundProgram Binder::bind(const dpde_program& program, std::vector<std::string> own, bool is_step) {
  BoundProgram bound{.executor = Executor(program, setup_.layout, setup_.team, solvers_, setup_.ranks)};
  memory_.add_program(bound.executor);
  if (!memory_.is_plan()) {
    bound.executor.make_stacks();
    bind_params(bound);
    sums_.bind_weights(bound.executor);
  }
  for (const std::string& name : names_.now) {
    const int field = bound.executor.field_index(name);
    const bool is_filled = is_step || filled_[bound.states.size()] != 0;
    bound.states.push_back(field);
    if (field >= 0 && !is_filled && bound.executor.prepares(field)) bound.fill_states.push_back(field);
    own.push_back(name);
  }
  bind_inputs(bound, own);
  return bound;
}

BoundStep Binder::bind_step(const dpde_program& program, std::vector<std::string> own) {
  std::vector<int> next;
  for (const dpde_swap& swap : std::span(program.swaps, static_cast<size_t>(program.swap_count))) {
    next.push_back(swap.next);
    own.emplace_back(program.fields[swap.next]);
  }
  BoundStep step{bind(program, std::move(own), true), std::move(next)};
  for (size_t s = filled_.size(); s < names_.now.size(); ++s)
    filled_.push_back(step.program.executor.prepares(step.program.states[s]) ? 1 : 0);
  return step;
}

BoundRate Binder::bind_rate() {
  if (!(setup_.courant > 0))
    throw Error(ErrorKind::input, fmt::format("the Courant number is {}; it must be positive", setup_.courant));
  BoundRate rate{bind(*setup_.rate, {}), -1};
  rate.field = rate.program.executor.field_index(setup_.rate_field);
  if (rate.field < setup_.rate->input_count)
    throw Error(ErrorKind::run, fmt::format("program {}: no result called {}", setup_.rate->name, setup_.rate_field));
  return rate;
}

BoundAdjoint Binder::bind_adjoint(const dpde_program& program, std::vector<std::string> own) {
  const int64_t bytes_before = memory_.bytes();
  std::vector<int> seeds, results;
  for (const std::string& next : names_.next) {
    const int seed = find_derived(program, DPDE_LINK_FIELD, next);
    const auto swaps = std::span(program.swaps, static_cast<size_t>(program.swap_count));
    const auto found = std::ranges::find(swaps, seed, &dpde_swap::state);
    if (found == swaps.end())
      throw Error(ErrorKind::run, fmt::format("program {}: no swap of the adjoint of {}", program.name, next));
    seeds.push_back(found->state);
    results.push_back(found->next);
    own.emplace_back(program.fields[seed]);
    own.emplace_back(program.fields[found->next]);
  }
  std::vector<FieldBar> totals;
  for (size_t i = 0; i < setup_.sought.size() && &program != setup_.adjoint; ++i) {
    const int field = find_derived(program, DPDE_LINK_FIELD, setup_.sought[i]);
    if (field < 0 || field >= program.input_count) continue;
    totals.push_back({field, i});
    own.emplace_back(program.fields[field]);
  }
  BoundAdjoint adjoint{bind(program, std::move(own)),
                       std::move(seeds),
                       std::move(results),
                       sums_.bind_params(program),
                       {},
                       std::move(totals),
                       0};
  adjoint.fields = sums_.bind_fields(program);
  adjoint.bytes = memory_.bytes() - bytes_before;
  return adjoint;
}

std::vector<BoundData> Binder::bind_data(const LossTerm& term, BoundProgram& bound) const {
  std::vector<BoundData> data;
  if (memory_.is_plan()) return data;
  for (const LossData& from : term.data) {
    if (from.at.size() != 1 && from.at.size() != term.at_steps.size()) {
      throw Error(ErrorKind::run, fmt::format("program {}: field {} is bound for {} of {} steps", term.loss->name,
                                              from.name, from.at.size(), term.at_steps.size()));
    }
    const int field = bound.executor.field_index(from.name);
    if (field < 0 || from.at.empty()) continue;
    if (std::ranges::find(from.at, nullptr) != from.at.end()) throw_not_bound(*term.loss, "field", from.name);
    bound.executor.bind(field, from.at.front());
    if (bound.executor.prepares(field)) bound.fill_inputs.push_back(field);
    data.push_back({field, from.at});
    if (from.at.size() == 1) data.back().at.assign(term.at_steps.size(), from.at.front());
  }
  return data;
}

BoundTerm Binder::bind_term(const LossTerm& term, int average) {
  if (term.loss == nullptr) throw Error(ErrorKind::run, "a loss term needs a loss program");
  std::vector<std::string> own;
  for (const LossData& data : term.data) own.push_back(data.name);
  BoundLoss loss{bind(*term.loss, own), 0, {}};
  if (term.sum.empty() && term.loss->sum_count != 1)
    throw Error(ErrorKind::run,
                fmt::format("program {} has {} sums: which one is the loss?", term.loss->name, term.loss->sum_count));
  const std::string sum = term.sum.empty() ? term.loss->sums[0] : term.sum;
  loss.sum = loss.program.executor.sum_index(sum);
  if (loss.sum < 0) throw Error(ErrorKind::run, fmt::format("program {}: no sum named {}", term.loss->name, sum));
  loss.data = bind_data(term, loss.program);
  BoundTerm bound{term.weight, std::move(loss), std::nullopt, -1, average, term.of_averages};
  if (term.adjoint == nullptr) return bound;
  bound.adjoint.emplace(bind_loss_adjoint(term, std::move(own)));
  bound.seed = find_derived(*term.adjoint, DPDE_LINK_SUM, sum);
  if (bound.seed >= 0) bound.adjoint->program.executor.set_param(bound.seed, term.weight);
  return bound;
}

BoundLossAdjoint Binder::bind_loss_adjoint(const LossTerm& term, std::vector<std::string> own) {
  const dpde_program& program = *term.adjoint;
  if (program.link_count == 0)
    throw Error(ErrorKind::run, fmt::format("program {} does not say what its derivatives belong to", program.name));
  std::vector<int> results;
  for (const std::string& name : names_.now) {
    results.push_back(find_derived(program, DPDE_LINK_FIELD, name));
    if (results.back() >= 0) own.emplace_back(program.fields[results.back()]);
  }
  BoundLossAdjoint adjoint{
      bind(program, std::move(own)), std::move(results), sums_.bind_params(program), sums_.bind_fields(program), {}};
  adjoint.data = bind_data(term, adjoint.program);
  return adjoint;
}

}  // namespace dpde
