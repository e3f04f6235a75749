// SPDX-License-Identifier: Apache-2.0
#include "run/binder.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>

#include "dpde/runtime/error.h"
#include "dpde/runtime/links.h"

namespace dpde {
namespace {

bool contains(const std::vector<ValueId>& ids, ValueId id) { return std::ranges::find(ids, id) != ids.end(); }

/// Whether the step may overwrite the state. Not with an interpreter: it reads fields after it has written others.
char may_be_over(const dpde_program& program, const dpde_swap& swap) {
  return swap.is_over != 0 && program.interpret == nullptr ? 1 : 0;
}

/// Whether the parameter is the seed of a loss adjoint, which the rollout sets.
bool is_seed(const dpde_program& program, int param) {
  return std::ranges::any_of(links_of(program), [&](const dpde_link& link) {
    return link.kind == DPDE_LINK_SUM && link.derived_kind == DPDE_LINK_PARAM && link.derived == param;
  });
}

}  // namespace

void Binder::bind_params(BoundProgram& bound) const {
  const dpde_program& program = bound.executor.program();
  const ProgramIds& ids = setup_.ids(program);
  for (int p = 0; p < program.param_count; ++p) {
    const ValueId id = ids.params[static_cast<size_t>(p)];
    if (id == ValueIds::t || is_seed(program, p)) continue;
    if (id == ValueIds::dt) {  // always from the setup, even if the caller binds this name
      bound.executor.set_param(p, setup_.dt);
    } else if (const int average = setup_.averages_at()[id]; average >= 0) {
      bound.averages.emplace_back(p, static_cast<size_t>(average));
    } else if (const int found = setup_.params_at()[id]; found >= 0) {
      bound.executor.set_param(p, setup_.params[static_cast<size_t>(found)].value);
    } else {
      throw_not_bound(program, "parameter", program.params[p]);
    }
  }
  bound.t_param = ids.param(ValueIds::t);
  bound.dt_param = ids.param(ValueIds::dt);
}

/// Binds the caller's fields. Throws for any other input that is not in `own`.
void Binder::bind_inputs(BoundProgram& bound, const std::vector<ValueId>& own) {
  const dpde_program& program = bound.executor.program();
  std::vector<int> temporaries;
  for (int f = 0; f < program.field_count; ++f) {
    const ValueId id = setup_.ids(program).fields[static_cast<size_t>(f)];
    if (contains(own, id)) continue;
    const int found = setup_.fields_at()[id];
    void* const base = found < 0 ? nullptr : setup_.fields[static_cast<size_t>(found)].base;
    if (f >= program.input_count) {
      temporaries.push_back(f);
    } else if (memory_.is_plan()) {
      continue;
    } else if (base == nullptr) {
      throw_not_bound(program, "field", program.fields[f]);
    } else {
      bound.executor.bind(f, base);
      if (bound.executor.prepares(f)) bound.fill_inputs.push_back(f);
      if (const int control = setup_.control_fields_at()[id]; control >= 0)
        bound.control_fields.emplace_back(f, static_cast<size_t>(control));
    }
  }
  bound.temporaries = memory_.pool(setup_.layout, static_cast<int64_t>(temporaries.size()));
  if (memory_.is_plan()) return;
  for (size_t i = 0; i < temporaries.size(); ++i)
    bound.executor.bind(temporaries[i], bound.temporaries.base(static_cast<int64_t>(i)));
}

/// own: fields that the caller of bind() binds itself, in addition to the states.
BoundProgram Binder::bind(const dpde_program& program, std::vector<ValueId> own, bool is_step) {
  BoundProgram bound{.executor = Executor(program, setup_.layout, setup_.team, solvers_, setup_.ranks)};
  memory_.add_program(bound.executor);
  if (!memory_.is_plan()) {
    bound.executor.make_stacks();
    bind_params(bound);
    sums_.bind_weights(bound.executor);
  }
  for (const ValueId id : states_.now) {
    const int field = setup_.ids(program).field(id);
    const bool is_filled = is_step || filled_[bound.states.size()] != 0;
    bound.states.push_back(field);
    if (field >= 0 && !is_filled && bound.executor.prepares(field)) bound.fill_states.push_back(field);
    own.push_back(id);
  }
  bind_inputs(bound, own);
  return bound;
}

BoundStep Binder::bind_step(const dpde_program& program, std::vector<ValueId> own) {
  std::vector<int> next;
  std::vector<char> is_over;
  for (const dpde_swap& swap : std::span(program.swaps, static_cast<size_t>(program.swap_count))) {
    next.push_back(swap.next);
    is_over.push_back(may_be_over(program, swap));
    own.push_back(setup_.ids(program).fields[static_cast<size_t>(swap.next)]);
  }
  BoundStep step{bind(program, std::move(own), true), std::move(next), std::move(is_over)};
  for (size_t s = filled_.size(); s < states_.now.size(); ++s)
    filled_.push_back(step.program.executor.prepares(step.program.states[s]) ? 1 : 0);
  return step;
}

BoundRate Binder::bind_rate() {
  if (!(setup_.courant > 0))
    throw Error(ErrorKind::input, fmt::format("the Courant number is {}; it must be positive", setup_.courant));
  BoundRate rate{bind(*setup_.rate, {}), -1};
  rate.field = setup_.ids(*setup_.rate).field(setup_.rate_field_id());
  if (rate.field < setup_.rate->input_count)
    throw Error(ErrorKind::run, fmt::format("program {}: no result called {}", setup_.rate->name, setup_.rate_field));
  return rate;
}

BoundAdjoint Binder::bind_adjoint(const dpde_program& program, std::vector<ValueId> own) {
  const ProgramIds& ids = setup_.ids(program);
  const int64_t bytes_before = memory_.bytes();
  std::vector<int> seeds, results;
  std::vector<char> is_over;
  for (const ValueId next : states_.next) {
    const int seed = ids.derived(DPDE_LINK_FIELD, next);
    const auto swaps = std::span(program.swaps, static_cast<size_t>(program.swap_count));
    const auto found = std::ranges::find(swaps, seed, &dpde_swap::state);
    if (found == swaps.end())
      throw Error(ErrorKind::run,
                  fmt::format("program {}: no swap of the adjoint of {}", program.name, setup_.values().name(next)));
    seeds.push_back(found->state);
    results.push_back(found->next);
    is_over.push_back(may_be_over(program, *found));
    own.push_back(ids.fields[static_cast<size_t>(seed)]);
    own.push_back(ids.fields[static_cast<size_t>(found->next)]);
  }
  std::vector<FieldBar> totals;
  for (size_t i = 0; i < setup_.sought.size() && &program != setup_.adjoint; ++i) {
    const int field = ids.derived(DPDE_LINK_FIELD, setup_.sought_id(i));
    if (field < 0 || field >= program.input_count) continue;
    totals.push_back({field, i});
    own.push_back(ids.fields[static_cast<size_t>(field)]);
  }
  BoundAdjoint adjoint{bind(program, std::move(own)),
                       std::move(seeds),
                       std::move(results),
                       std::move(is_over),
                       sums_.bind_params(program),
                       {},
                       std::move(totals),
                       0};
  adjoint.fields = sums_.bind_fields(program);
  adjoint.bytes = memory_.bytes() - bytes_before;
  return adjoint;
}

std::vector<BoundData> Binder::bind_data(size_t number, BoundProgram& bound) const {
  const LossTerm& term = setup_.losses[number];
  std::vector<BoundData> data;
  for (size_t d = 0; d < term.data.size() && !memory_.is_plan(); ++d) {
    const LossData& from = term.data[d];
    if (from.at.size() != 1 && from.at.size() != term.at_steps.size()) {
      throw Error(ErrorKind::run, fmt::format("program {}: field {} is bound for {} of {} steps", term.loss->name,
                                              from.name, from.at.size(), term.at_steps.size()));
    }
    const int field = setup_.ids(bound.executor.program()).field(setup_.loss(number).data[d]);
    if (field < 0 || from.at.empty()) continue;
    if (std::ranges::find(from.at, nullptr) != from.at.end()) throw_not_bound(*term.loss, "field", from.name);
    bound.executor.bind(field, from.at.front());
    if (bound.executor.prepares(field)) bound.fill_inputs.push_back(field);
    data.push_back({field, from.at});
    if (from.at.size() == 1) data.back().at.assign(term.at_steps.size(), from.at.front());
  }
  return data;
}

BoundTerm Binder::bind_term(size_t number) {
  const LossTerm& term = setup_.losses[number];
  const ResolvedSetup::LossIds& ids = setup_.loss(number);
  if (term.loss == nullptr) throw Error(ErrorKind::run, "a loss term needs a loss program");
  BoundLoss loss{bind(*term.loss, ids.data), 0, {}};
  if (term.sum.empty() && term.loss->sum_count != 1)
    throw Error(ErrorKind::run,
                fmt::format("program {} has {} sums: which one is the loss?", term.loss->name, term.loss->sum_count));
  loss.sum = setup_.ids(*term.loss).sum(ids.sum);
  if (loss.sum < 0) throw Error(ErrorKind::run, fmt::format("program {}: no sum named {}", term.loss->name, term.sum));
  loss.data = bind_data(number, loss.program);
  BoundTerm bound{term.weight, std::move(loss), std::nullopt, -1, setup_.averages_at()[ids.average], term.of_averages};
  if (term.adjoint == nullptr) return bound;
  bound.adjoint.emplace(bind_loss_adjoint(number, ids.data));
  bound.seed = setup_.ids(*term.adjoint).derived(DPDE_LINK_SUM, ids.sum);
  if (bound.seed >= 0) bound.adjoint->program.executor.set_param(bound.seed, term.weight);
  return bound;
}

BoundLossAdjoint Binder::bind_loss_adjoint(size_t number, std::vector<ValueId> own) {
  const dpde_program& program = *setup_.losses[number].adjoint;
  const ProgramIds& ids = setup_.ids(program);
  if (program.link_count == 0)
    throw Error(ErrorKind::run, fmt::format("program {} does not say what its derivatives belong to", program.name));
  std::vector<int> results;
  for (const ValueId id : states_.now) {
    results.push_back(ids.derived(DPDE_LINK_FIELD, id));
    if (results.back() >= 0) own.push_back(ids.fields[static_cast<size_t>(results.back())]);
  }
  BoundLossAdjoint adjoint{
      bind(program, std::move(own)), std::move(results), sums_.bind_params(program), sums_.bind_fields(program), {}};
  adjoint.data = bind_data(number, adjoint.program);
  return adjoint;
}

}  // namespace dpde
