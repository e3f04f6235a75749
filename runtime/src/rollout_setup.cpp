// SPDX-License-Identifier: Apache-2.0
// Construction of a rollout: every name of every program is looked up here, once; everything that is missing is an
// error that names it; all memory is allocated.
#include <fmt/format.h>

#include <algorithm>

#include "aligned_memory.h"
#include "dpde/runtime/allocation.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/links.h"
#include "rollout_impl.h"

namespace dpde {
namespace {

[[noreturn]] void not_bound(const dpde_program& program, std::string_view what, std::string_view name) {
  throw Error(ErrorKind::run, fmt::format("program {}: {} {} is not bound", program.name, what, name));
}

bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::ranges::any_of(names, [&](const std::string& other) { return other == name; });
}

void check_steps(const RolloutSetup& setup) {
  if (setup.steps < 0)
    throw Error(ErrorKind::input, fmt::format("the number of steps is {}; it must not be negative", setup.steps));
  for (const LossTerm& term : setup.losses) {
    for (size_t i = 0; i < term.at_steps.size(); ++i) {
      const int step = term.at_steps[i];
      if (step < 0 || step > setup.steps) {
        throw Error(ErrorKind::input, fmt::format("a loss at step {} of a run of {} steps", step, setup.steps));
      }
      if (i > 0 && step <= term.at_steps[i - 1])
        throw Error(ErrorKind::input, fmt::format("the steps of a loss are not increasing at {}", step));
    }
  }
}

/// What looks beyond a subgrid otherwise than programs do.
void check_divided(RolloutSetup& setup) {
  if (!is_divided(setup.layout)) return;
  const auto fail = [](const char* what) {
    throw Error(ErrorKind::run, fmt::format("a grid that is divided among ranks cannot have {}", what));
  };
  if (setup.steady > 0) fail("runs until steady");
  if (setup.block_steps > 1) fail("several steps at once");
  setup.block_steps = 1;
}

}  // namespace

Rollout::Impl::Impl(RolloutSetup from, Purpose why)
    : setup(std::move(from)), purpose(why), solvers(setup.solvers ? setup.solvers : make_solver_store()) {
  check_steps(setup);
  check_divided(setup);
  place_sought();
  if (setup.steady > 0) setup.block_steps = 1;  // each step is looked at
  bind_step();
  is_rate.resize(state_names.size());
  for (size_t s = 0; s < is_rate.size(); ++s) is_rate[s] = contains(setup.rates, state_names[s]);
  if (setup.rate != nullptr) bind_rate();
  if (purpose == Purpose::run) plan_block();
  if (setup.adjoint != nullptr) bind_adjoint(*setup.adjoint);
  for (const LossTerm& term : setup.losses) bind_term(term);
  result.param_bars.assign(param_bar_names.size(), 0.0);
  result.control_bars.resize(param_bar_names.size());
  control_every.assign(param_bar_names.size(), 1);
  schedule_losses();
  plan_storage();
  allocate_states();
  if (purpose == Purpose::plan) return;
  if (backward) make_frames();
  for_each_program([&](BoundProgram& program) { program.executor.update_uniforms(); });
  set_tuning(setup.tuning);
  if (setup.seconds != nullptr) set_clocks(*setup.seconds);
}

GradientPlan plan_gradient(RolloutSetup setup) {
  const Rollout::Impl impl(std::move(setup), Rollout::Impl::Purpose::plan);
  const int block = impl.marks.empty() ? 1 : impl.backward->block->steps();
  return {impl.keeps_trajectory,
          block,
          impl.result.stored_states,
          impl.result.recomputed_steps,
          impl.result.checkpoint_bytes,
          impl.result.tape_bytes,
          impl.bytes_of_fields,
          impl.kept_fields(),
          impl.owned};
}

void Rollout::Impl::set_clocks(GradientSeconds& seconds) {
  forward->program.executor.set_clock(&seconds.steps);
  if (keeping) keeping->step.program.executor.set_clock(&seconds.steps);
  if (backward) backward->program.executor.set_clock(&seconds.adjoints);
  for (BoundTerm& term : terms) {
    term.loss.program.executor.set_clock(&seconds.losses);
    if (term.adjoint) term.adjoint->program.executor.set_clock(&seconds.losses);
  }
}

void Rollout::Impl::bind_params(BoundProgram& bound) {
  const dpde_program& program = bound.executor.program();
  for (int p = 0; p < program.param_count; ++p) {
    const std::string_view name = program.params[p];
    const auto is_seed = [&](const dpde_link& link) {
      return link.kind == DPDE_LINK_SUM && link.derived_kind == DPDE_LINK_PARAM && link.derived == p;
    };
    if (name == "t" || std::ranges::any_of(links_of(program), is_seed)) continue;
    if (name == "dt") {  // what the caller binds under that name is not asked
      bound.executor.set_param(p, setup.dt);
      continue;
    }
    if (std::ranges::find(averages, name, &Average::name) != averages.end()) continue;  // see give_averages()
    const auto found = std::ranges::find(setup.params, name, &BoundParam::name);
    if (found == setup.params.end()) not_bound(program, "parameter", name);
    bound.executor.set_param(p, found->value);
  }
  bound.t_param = bound.executor.param_index("t");
  bound.dt_param = bound.executor.param_index("dt");
}

/// `adds`: adjoints add to the gradient by the weights.
void Rollout::Impl::bind_weights(BoundProgram& bound, bool adds) {
  const dpde_program& program = bound.executor.program();
  for (int i = 0; i < program.network_count; ++i) {
    const dpde_network& network = *program.networks[i];
    const auto given = std::ranges::find(setup.weights, network.name, &BoundWeights::network);
    if (given == setup.weights.end() || (given->values == nullptr && network.weight_count > 0))
      not_bound(program, "network", network.name);
    auto bars = std::ranges::find(weight_bars, network.name, &WeightBars::network);
    if (given->learned && bars == weight_bars.end()) {
      const std::vector<double> zero(static_cast<size_t>(network.weight_count));
      bars = weight_bars.insert(bars, {network.name, zero, zero});
    }
    const bool is_added_to = given->learned && adds;
    bound.executor.bind_weights(i, {given->values, given->rates, is_added_to ? bars->values.data() : nullptr,
                                    is_added_to ? bars->rates.data() : nullptr, given->host});
  }
}

/// Binds the caller's fields; whatever else is not computed by the program and not in own_fields is missing.
void Rollout::Impl::bind_inputs(BoundProgram& bound, const std::vector<std::string>& own_fields) {
  const dpde_program& program = bound.executor.program();
  std::vector<int> temporaries;
  for (int f = 0; f < program.field_count; ++f) {
    const std::string_view name = program.fields[f];
    if (contains(own_fields, name)) continue;
    const auto found = std::ranges::find(setup.fields, name, &BoundField::name);
    if (f >= program.input_count) {
      temporaries.push_back(f);
    } else if (purpose == Purpose::plan) {
      continue;
    } else if (found == setup.fields.end() || found->base == nullptr) {
      not_bound(program, "field", name);
    } else {
      bound.executor.bind(f, found->base);
      if (bound.executor.prepares(f)) bound.fill_inputs.push_back(f);
      const auto control = std::ranges::find(setup.control_fields, name, &ControlField::name);
      if (control != setup.control_fields.end())
        bound.control_fields.emplace_back(f, control - setup.control_fields.begin());
    }
  }
  bound.temporaries = make_pool(setup.layout, static_cast<int64_t>(temporaries.size()));
  if (purpose == Purpose::plan) return;
  for (size_t i = 0; i < temporaries.size(); ++i)
    bound.executor.bind(temporaries[i], bound.temporaries.base(static_cast<int64_t>(i)));
}

/// own_fields: fields that the caller of this function binds itself (beside the states).
BoundProgram Rollout::Impl::bind_program(const dpde_program& program, const std::vector<std::string>& own_fields,
                                         bool is_step) {
  BoundProgram bound{.executor = Executor(program, setup.layout, setup.team, solvers, setup.ranks)};
  std::ranges::move(bound.executor.memory(), std::back_inserter(owned));
  if (purpose == Purpose::run) bound.executor.make_stacks();
  if (purpose == Purpose::run) {
    bind_params(bound);
    bind_weights(bound);
  }
  std::vector<std::string> own = own_fields;
  for (const std::string& name : state_names) {
    const int field = bound.executor.field_index(name);
    const bool is_filled = is_step || forward->program.executor.prepares(forward->program.states[bound.states.size()]);
    bound.states.push_back(field);
    if (field >= 0 && !is_filled && bound.executor.prepares(field)) bound.fill_states.push_back(field);
    own.push_back(name);
  }
  bind_inputs(bound, own);
  return bound;
}

void Rollout::Impl::bind_step() {
  if (setup.step == nullptr) throw Error(ErrorKind::run, "a rollout needs a step program");
  const dpde_program& program = setup.trial != nullptr ? *setup.trial : *setup.step;
  if (setup.trial != nullptr && (program.sum_count != 1 || !(setup.first_part > 0) || setup.error_order < 1))
    throw Error(ErrorKind::run, fmt::format("program {} does not estimate the error of its step", program.name));
  std::vector<std::string> own;
  for (int s = 0; s < program.swap_count; ++s) {
    state_names.emplace_back(program.fields[program.swaps[s].state]);
    next_names.emplace_back(setup.step->fields[setup.step->swaps[s].next]);  // as the adjoint knows them
    own.emplace_back(program.fields[program.swaps[s].next]);
    bytes_of_fields += allocated_bytes(field_bytes(setup.layout) + stagger_of(setup.layout, s));
    if (purpose == Purpose::run) initial.emplace_back(setup.layout, s);
  }
  forward.emplace(BoundStep{bind_program(program, own, true), {}});
  for (int s = 0; s < program.swap_count; ++s) forward->next.push_back(program.swaps[s].next);
}

void Rollout::Impl::bind_rate() {
  if (!(setup.courant > 0))
    throw Error(ErrorKind::input, fmt::format("the Courant number is {}; it must be positive", setup.courant));
  rate.emplace(BoundRate{bind_program(*setup.rate, {}, false), -1});
  rate->field = rate->program.executor.field_index(setup.rate_field);
  if (rate->field < setup.rate->input_count)
    throw Error(ErrorKind::run, fmt::format("program {}: no result called {}", setup.rate->name, setup.rate_field));
}

/// own: fields that are bound by whoever calls this.
void Rollout::Impl::bind_adjoint(const dpde_program& program, std::vector<std::string> own) {
  const int64_t bytes_before = bytes_of_fields;
  std::vector<int> seeds, results;
  for (const std::string& next : next_names) {
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
  for (size_t i = 0; i < setup.sought.size() && &program != setup.adjoint; ++i) {
    const int field = find_derived(program, DPDE_LINK_FIELD, setup.sought[i]);
    if (field < 0 || field >= program.input_count) continue;
    totals.push_back({field, i});
    own.emplace_back(program.fields[field]);
  }
  backward.emplace(BoundAdjoint{bind_program(program, own, false),
                                std::move(seeds),
                                std::move(results),
                                bind_param_bars(program),
                                {},
                                std::move(totals),
                                {},
                                {},
                                {}});
  backward->fields = bind_field_bars(backward->program.executor);
  backward->bytes = bytes_of_fields - bytes_before;
}

/// Where steps are reversed one by one. (Blocks of steps add rows to totals while they are in the first cache.)
void Rollout::Impl::take_total_adjoint() {
  if (setup.total_adjoint == nullptr || setup.steady > 0 || backward->block) return;
  bytes_of_fields -= backward->bytes;
  backward.reset();  // its memory is not held beside that of the other
  bind_adjoint(*setup.total_adjoint);
}

void Rollout::Impl::place_sought() {
  for (const ControlField& control : setup.control_fields) {
    if (control.every < 1 || control.at.empty())
      throw Error(ErrorKind::input,
                  fmt::format("control field {} needs intervals of at least one step, and fields", control.name));
  }
  size_t next = 0;
  for (const std::string& name : setup.sought) {
    SoughtField& field = sought.emplace_back(SoughtField{next});
    const auto control = std::ranges::find(setup.control_fields, name, &ControlField::name);
    if (control != setup.control_fields.end()) field = {next, control->at.size(), control->every};
    next += field.count;
  }
}

/// Bars are results, which bind_inputs gave memory among the temporaries.
std::vector<FieldBar> Rollout::Impl::bind_field_bars(const Executor& executor) const {
  std::vector<FieldBar> found;
  for (size_t i = 0; i < setup.sought.size(); ++i) {
    const int field = find_derived(executor.program(), DPDE_LINK_FIELD, setup.sought[i]);
    if (field >= executor.program().input_count) found.push_back({field, i});
  }
  return found;
}

std::vector<ParamBar> Rollout::Impl::bind_param_bars(const dpde_program& program) {
  std::vector<ParamBar> bars_found;
  for (const dpde_link& link : links_of(program)) {
    if (link.kind != DPDE_LINK_PARAM || link.derived < 0) continue;
    auto place = std::ranges::find(param_bar_names, link.primal);
    if (place == param_bar_names.end()) place = param_bar_names.emplace(place, link.primal);
    bars_found.push_back({static_cast<size_t>(link.derived), static_cast<size_t>(place - param_bar_names.begin())});
  }
  return bars_found;
}

std::vector<BoundData> Rollout::Impl::bind_data(const LossTerm& term, BoundProgram& bound) {
  std::vector<BoundData> data;
  if (purpose == Purpose::plan) return data;
  for (const LossData& from : term.data) {
    if (from.at.size() != 1 && from.at.size() != term.at_steps.size()) {
      throw Error(ErrorKind::run, fmt::format("program {}: field {} is bound for {} of {} steps", term.loss->name,
                                              from.name, from.at.size(), term.at_steps.size()));
    }
    const int field = bound.executor.field_index(from.name);
    if (field < 0 || from.at.empty()) continue;
    if (std::ranges::find(from.at, nullptr) != from.at.end()) not_bound(*term.loss, "field", from.name);
    bound.executor.bind(field, from.at.front());
    if (bound.executor.prepares(field)) bound.fill_inputs.push_back(field);
    data.push_back({field, from.at});
    if (from.at.size() == 1) data.back().at.assign(term.at_steps.size(), from.at.front());
  }
  return data;
}

void Rollout::Impl::bind_term(const LossTerm& term) {
  if (term.loss == nullptr) throw Error(ErrorKind::run, "a loss term needs a loss program");
  std::vector<std::string> own;
  for (const LossData& data : term.data) own.push_back(data.name);
  BoundLoss loss{bind_program(*term.loss, own, false), 0, {}};
  if (term.sum.empty() && term.loss->sum_count != 1)
    throw Error(ErrorKind::run,
                fmt::format("program {} has {} sums: which one is the loss?", term.loss->name, term.loss->sum_count));
  const std::string sum = term.sum.empty() ? term.loss->sums[0] : term.sum;
  loss.sum = loss.program.executor.sum_index(sum);
  if (loss.sum < 0) throw Error(ErrorKind::run, fmt::format("program {}: no sum named {}", term.loss->name, sum));
  loss.data = bind_data(term, loss.program);
  const int average = term.average.empty() ? -1 : average_called(term.average);
  terms.push_back({term.weight, std::move(loss), std::nullopt, -1, average, term.of_averages});
  if (term.adjoint == nullptr) return;
  if (term.adjoint->link_count == 0)
    throw Error(ErrorKind::run,
                fmt::format("program {} does not say what its derivatives belong to", term.adjoint->name));
  std::vector<int> results;
  for (const std::string& name : state_names) results.push_back(find_derived(*term.adjoint, DPDE_LINK_FIELD, name));
  for (const int result : results) {
    if (result >= 0) own.emplace_back(term.adjoint->fields[result]);
  }
  BoundLossAdjoint adjoint{bind_program(*term.adjoint, own, false), {}, bind_param_bars(*term.adjoint), {}, {}};
  const Executor& executor = adjoint.program.executor;
  adjoint.results = std::move(results);
  const int seed = find_derived(*term.adjoint, DPDE_LINK_SUM, sum);
  if (seed >= 0) adjoint.program.executor.set_param(seed, term.weight);
  terms.back().seed = seed;
  adjoint.fields = bind_field_bars(executor);
  adjoint.data = bind_data(term, adjoint.program);
  terms.back().adjoint.emplace(std::move(adjoint));
}

void Rollout::Impl::schedule_losses() {
  for (size_t term = 0; term < setup.losses.size(); ++term) {
    const std::vector<int>& at_steps = setup.losses[term].at_steps;
    for (size_t entry = 0; entry < at_steps.size(); ++entry) events.push_back({at_steps[entry], term, entry});
  }
  std::ranges::stable_sort(events, {}, &LossEvent::step);
  if (!events.empty()) last_loss = events.back().step;
}

/// Paragraphs: the name of a program, its sweeps, an empty line.
std::string Rollout::Impl::tuning() {
  std::string text;
  for_each_program([&](BoundProgram& program) {
    const std::string found = program.executor.tuning();
    if (!found.empty()) text += program.executor.program().name + ('\n' + found) + '\n';
  });
  return text;
}

void Rollout::Impl::set_tuning(std::string_view text) {
  for_each_program([&](BoundProgram& program) {
    const std::string head = program.executor.program().name + std::string("\n");
    for (size_t at = 0; at < text.size(); at = std::min(text.find("\n\n", at), text.size() - 2) + 2) {
      if (text.substr(at).starts_with(head)) program.executor.set_tuning(text.substr(at + head.size()));
    }
  });
}

Rollout::Rollout(RolloutSetup setup) : impl_(std::make_unique<Impl>(std::move(setup))) {}
Rollout::~Rollout() = default;
Rollout::Rollout(Rollout&&) noexcept = default;
Rollout& Rollout::operator=(Rollout&&) noexcept = default;

std::deque<SolveNote> Rollout::solve_notes() const {
  std::deque<SolveNote> notes = impl_->forward->program.executor.solve_notes();
  for (BoundTerm& term : impl_->terms) {
    const std::deque<SolveNote>& of_loss = term.loss.program.executor.solve_notes();
    notes.insert(notes.end(), of_loss.begin(), of_loss.end());
  }
  return notes;
}
const SolveNote* Rollout::without_derivative() const {
  const auto find = [](BoundProgram& program) -> const SolveNote* {
    const std::deque<SolveNote>& notes = program.executor.solve_notes();
    const auto found = std::ranges::find_if(notes, [](const SolveNote& note) { return note.of_least_squares > 0; });
    return found == notes.end() ? nullptr : &*found;
  };
  if (const SolveNote* found = find(impl_->forward->program)) return found;
  for (BoundTerm& term : impl_->terms) {
    if (const SolveNote* found = find(term.loss.program)) return found;
  }
  return nullptr;
}
std::deque<SolveNote> Rollout::adjoint_solve_notes() const {
  std::deque<SolveNote> notes;
  if (impl_->backward) notes = impl_->backward->program.executor.solve_notes();
  for (BoundTerm& term : impl_->terms) {
    if (!term.adjoint) continue;
    const std::deque<SolveNote>& of_loss = term.adjoint->program.executor.solve_notes();
    notes.insert(notes.end(), of_loss.begin(), of_loss.end());
  }
  return notes;
}
int Rollout::block_steps() const { return impl_->forward->block ? impl_->forward->block->steps() : 1; }
std::string Rollout::tuning() const { return impl_->tuning(); }
int Rollout::gradient_block_steps() const { return impl_->marks.empty() ? 1 : impl_->backward->block->steps(); }
int Rollout::state_count() const { return static_cast<int>(impl_->state_names.size()); }
const std::string& Rollout::state_name(int state) const { return impl_->state_names[static_cast<size_t>(state)]; }
int Rollout::state_index(std::string_view name) const {
  const auto found = std::ranges::find(impl_->state_names, name);
  return found == impl_->state_names.end() ? -1 : static_cast<int>(found - impl_->state_names.begin());
}
void Rollout::update_weights() { impl_->update_weights(); }
Field& Rollout::initial(int state) { return impl_->initial[static_cast<size_t>(state)]; }

bool Rollout::set_param(std::string_view name, double value) {
  bool found = false;
  impl_->for_each_program([&](BoundProgram& program) {
    const int param = program.executor.param_index(name);
    if (param < 0) return;
    program.executor.set_param(param, value);  // uniforms, which may cost as much as a step, wait for the next run
    found = true;
  });
  return found;
}

void Rollout::set_begin(double t0) { impl_->setup.t0 = t0; }
const StepRecord& Rollout::record() const { return impl_->steps_made(); }
void Rollout::follow(const StepRecord* record) { impl_->followed = record; }
const StepController& Rollout::controller() const { return impl_->controller; }
void Rollout::set_controller(const StepController& controller) { impl_->controller = controller; }

void Rollout::Impl::set_control(std::string_view name, int every, std::span<const double> values) {
  if (every < 1 || values.empty())
    throw Error(ErrorKind::input, fmt::format("control {} needs intervals of at least one step, and values", name));
  auto control = std::ranges::find(controls, name, &Control::name);
  if (control == controls.end()) {
    control = controls.insert(control, {std::string(name), every, {}});
    for_each_program([&](BoundProgram& program) {
      const int param = program.executor.param_index(name);
      if (param >= 0) program.controls.emplace_back(param, controls.size() - 1);
    });
  }
  control->every = every;
  control->values.assign(values.begin(), values.end());
  const auto bar_of = std::ranges::find(param_bar_names, name);
  if (bar_of == param_bar_names.end()) return;
  const auto number = static_cast<size_t>(bar_of - param_bar_names.begin());
  result.control_bars[number].resize(values.size());
  control_every[number] = every;
}

void Rollout::set_control(std::string_view name, int every, std::span<const double> values) {
  impl_->set_control(name, every, values);
}

RunResult Rollout::run(const Observer& observer, int first) { return impl_->run(observer, first); }
const std::vector<void*>& Rollout::final_states() const { return impl_->final_states; }
void Rollout::restart() { impl_->restart(); }
RunResult Rollout::advance(int steps) { return impl_->advance(steps); }
const std::vector<void*>& Rollout::present() const { return impl_->final_states; }
double Rollout::loss() { return impl_->loss(); }
const GradientResult& Rollout::gradient() { return impl_->gradient(); }
const std::vector<std::string>& Rollout::param_bar_names() const { return impl_->param_bar_names; }
FieldView Rollout::bar_of(std::string_view field) const { return impl_->bar_of(field); }
void Rollout::copy_field_bar(std::string_view field, std::span<double> to) const { impl_->copy_field_bar(field, to); }
void Rollout::copy_param_bar(std::string_view param, std::span<double> to) const { impl_->copy_param_bar(param, to); }
void Rollout::copy_rate_bar(std::string_view network, std::span<double> to) const { impl_->copy_rate_bar(network, to); }
void Rollout::watch_gradient(GradientCallback call, int every) {
  impl_->watch = std::move(call);
  impl_->watch_every = std::max(every, 1);
}
const FarState* Rollout::far_state() const { return impl_->far ? &*impl_->far : nullptr; }
bool Rollout::was_stopped() const { return impl_->result.stopped; }
double Rollout::adjoint_norm() const { return impl_->adjoint_norm(); }

const std::vector<std::string>& Rollout::sought() const { return impl_->setup.sought; }

}  // namespace dpde
