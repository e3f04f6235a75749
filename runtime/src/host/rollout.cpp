// SPDX-License-Identifier: Apache-2.0
// Assembles a rollout from the classes of run/: ownership, order of construction, and dispatch of the public calls.
#include "dpde/runtime/rollout.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "dpde/runtime/error.h"
#include "dpde/runtime/float_mode.h"
#include "dpde/runtime/layout.h"
#include "run/forward/forward_run.h"
#include "run/reverse/gradient.h"

namespace dpde {
namespace {

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

/// Refuses features that look beyond a subgrid by other means than programs.
void check_divided(RolloutSetup& setup) {
  if (!is_divided(setup.layout)) return;
  const auto fail = [](const char* what) {
    throw Error(ErrorKind::run, fmt::format("a grid that is divided among ranks cannot have {}", what));
  };
  if (setup.steady > 0) fail("runs until steady");
  if (setup.block_steps > 1) fail("several steps at once");
  setup.block_steps = 1;
}

RolloutSetup checked(RolloutSetup setup) {
  check_steps(setup);
  check_divided(setup);
  if (setup.steady > 0) setup.block_steps = 1;  // each step is checked
  return setup;
}

void check_adjoints(bool has_step_adjoint, const std::vector<BoundTerm>& terms) {
  if (!has_step_adjoint) throw Error(ErrorKind::run, "the gradient needs the adjoint of the step");
  for (const BoundTerm& term : terms) {
    if (term.adjoint || term.average >= 0) continue;  // averages may depend on data alone
    throw Error(ErrorKind::run, fmt::format("the gradient needs the adjoint of the loss {}",
                                            term.loss.program.executor.program().name));
  }
}

void append(std::deque<SolveNote>& notes, BoundProgram& program) {
  const std::deque<SolveNote>& more = program.executor.solve_notes();
  notes.insert(notes.end(), more.begin(), more.end());
}

}  // namespace

struct Rollout::Impl {
  using Purpose = RunMemory::Purpose;
  explicit Impl(RolloutSetup from, Purpose purpose = Purpose::run);

  void allocate();
  template <class Visit>
  void for_each_program(const Visit& visit);
  void set_clocks(GradientSeconds& seconds);
  std::string tuning();
  void set_tuning(std::string_view text);
  void set_control(std::string_view name, int every, std::span<const double> values);
  void update_weights();
  void begin(int first = 0);
  RunResult run(const Observer& observer, int first);
  double loss();
  const GradientResult& gradient();

  ResolvedSetup setup;
  RunMemory memory;
  GradientResult result;
  GradientSums sums;
  States states;
  StepInputs inputs;
  Binder binder;
  Stepper stepper;
  Losses losses;
  std::optional<WayBack> back;
  Trajectory trajectory;
  RunWatch watch;
  SteadyRun steady;
  ForwardRun forward;
  std::optional<Gradient> way;  // forward and back
};

template <class Visit>
void Rollout::Impl::for_each_program(const Visit& visit) {
  stepper.for_each_program(visit);
  if (back) {
    if (KeptSteps* const kept = back->adjoint.kept()) visit(kept->program());
    visit(back->adjoint.program());
  }
  for (BoundTerm& term : losses.terms()) {
    visit(term.loss.program);
    if (term.adjoint) visit(term.adjoint->program);
  }
}

Rollout::Impl::Impl(RolloutSetup from, Purpose purpose)
    : setup(checked(std::move(from))),
      memory(purpose, setup.adjoint != nullptr),
      sums(setup, result),
      states(setup, memory),
      inputs(setup),
      binder(setup, states.ids(), memory, sums),
      stepper(setup, inputs, states, binder),
      losses(setup, inputs, states),
      trajectory(setup, states.ids(), losses),
      watch(setup),
      steady(setup, inputs, states, stepper, watch),
      forward(setup, inputs, states, stepper, losses, steady, watch) {
  if (!memory.is_plan()) stepper.plan_block();
  if (setup.adjoint != nullptr) back.emplace(setup, inputs, stepper, losses, sums, states.count(), binder);
  losses.bind(binder);
  trajectory.plan(stepper, losses, back ? &*back : nullptr, binder, memory);
  allocate();
  if (memory.is_plan()) return;
  forward.begin();
  if (back) way.emplace(setup, inputs, states, stepper, losses, trajectory, *back, steady, watch);
  for_each_program([](BoundProgram& program) { program.executor.update_uniforms(); });
  set_tuning(setup.tuning);
  if (setup.seconds != nullptr) set_clocks(*setup.seconds);
}

void Rollout::Impl::allocate() {
  states.allocate(trajectory.buffers(), memory, back ? setup.checkpoint_folder : "");
  sums.size_params();
  result.stored_states = trajectory.stored_states();
  result.recomputed_steps = trajectory.recomputed_steps();
  result.checkpoint_bytes = trajectory.bytes();
  result.tape_bytes = trajectory.tapes().bytes();
  if (!back) return;
  back->adjoint.allocate(memory);
  const std::vector<char> apart(states.count(), 0);
  back->bars.allocate(memory, back->legs.block_steps() == 1 ? back->adjoint.bound().is_over : apart);
  sums.allocate(memory);
  result.state_bars.assign(states.count(), {});
}

GradientPlan plan_gradient(RolloutSetup setup) {
  const Rollout::Impl impl(std::move(setup), RunMemory::Purpose::plan);
  const GradientResult& result = impl.result;
  return {impl.trajectory.is_stored(), impl.back ? impl.back->legs.block_steps() : 1,
          result.stored_states,        result.recomputed_steps,
          result.checkpoint_bytes,     result.tape_bytes,
          impl.memory.bytes(),         impl.back ? impl.back->adjoint.kept_fields() : 0,
          impl.memory.owned(),         impl.setup.fields};
}

void Rollout::Impl::set_clocks(GradientSeconds& seconds) {
  stepper.program().executor.set_clock(&seconds.steps);
  if (back) {
    if (KeptSteps* const kept = back->adjoint.kept()) kept->program().executor.set_clock(&seconds.steps);
    back->adjoint.program().executor.set_clock(&seconds.adjoints);
  }
  for (BoundTerm& term : losses.terms()) {
    term.loss.program.executor.set_clock(&seconds.losses);
    if (term.adjoint) term.adjoint->program.executor.set_clock(&seconds.losses);
  }
}

/// Format: paragraphs of a program's name, its sweeps, an empty line.
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

void Rollout::Impl::set_control(std::string_view name, int every, std::span<const double> values) {
  if (every < 1 || values.empty())
    throw Error(ErrorKind::input, fmt::format("control {} needs intervals of at least one step, and values", name));
  const ValueId id = setup.values().find(name);
  if (id == no_value) return;  // no program reads it
  if (const std::optional<size_t> number = inputs.set_control(id, every, values)) {
    for_each_program([&](BoundProgram& program) {
      const int param = setup.ids(program.executor.program()).param(id);
      if (param >= 0) program.controls.emplace_back(param, *number);
    });
  }
  sums.set_control(id, every, values.size());
}

void Rollout::Impl::update_weights() {
  if (!setup.weights.empty()) for_each_program([](BoundProgram& program) { program.executor.update_weights(); });
}

/// Fills all halos of fields that the caller may have changed.
void Rollout::Impl::begin(int first) {
  losses.forget_far_state();
  update_weights();
  stepper.control().begin(first);
  stepper.prepare(first, states.first());
}

RunResult Rollout::Impl::run(const Observer& observer, int first) {
  const FloatScope without_subnormals;
  const auto start = std::chrono::steady_clock::now();
  begin(first);
  RunResult done = forward.run(observer, first, without_subnormals.before());
  done.seconds = seconds_since(start);
  return done;
}

double Rollout::Impl::loss() {
  const FloatScope without_subnormals;
  begin();
  losses.begin();
  watch.begin(losses.last(), without_subnormals.before());
  const bool is_complete = forward.add_losses();
  result.stopped = !is_complete && (setup.steady == 0 || steady.was_stopped());
  return is_complete ? losses.value() : std::numeric_limits<double>::quiet_NaN();
}

const GradientResult& Rollout::Impl::gradient() {
  check_adjoints(back.has_value(), losses.terms());
  const FloatScope without_subnormals;
  const auto start = std::chrono::steady_clock::now();
  begin();
  losses.begin();
  sums.begin();
  watch.begin(2 * int64_t{losses.last()} + result.recomputed_steps, without_subnormals.before());
  result.stopped = !way->run(result, start);
  result.loss = losses.value();
  for (size_t i = 0; i < states.count(); ++i) result.state_bars[i] = {&setup.layout, back->bars.seeds()[i]};
  result.checkpoint_bytes = trajectory.bytes() + stepper.part_states().fields() * FieldPool::stride_of(setup.layout);
  result.total_seconds = seconds_since(start);
  return result;
}

Rollout::Rollout(RolloutSetup setup) : impl_(std::make_unique<Impl>(std::move(setup))) {}
Rollout::~Rollout() = default;
Rollout::Rollout(Rollout&&) noexcept = default;
Rollout& Rollout::operator=(Rollout&&) noexcept = default;

std::deque<SolveNote> Rollout::solve_notes() const {
  std::deque<SolveNote> notes;
  append(notes, impl_->stepper.program());
  for (BoundTerm& term : impl_->losses.terms()) append(notes, term.loss.program);
  return notes;
}
const SolveNote* Rollout::without_derivative(const std::function<bool(std::string_view)>& is_unknown) const {
  const auto find = [&](BoundProgram& program) -> const SolveNote* {
    const std::deque<SolveNote>& notes = program.executor.solve_notes();
    const auto found = std::ranges::find_if(notes, [&](const SolveNote& note) {
      return note.out_of_reach.of_least_squares > 0 || std::ranges::any_of(note.out_of_reach.made_of, is_unknown);
    });
    return found == notes.end() ? nullptr : &*found;
  };
  if (const SolveNote* found = find(impl_->stepper.program())) return found;
  for (BoundTerm& term : impl_->losses.terms()) {
    if (const SolveNote* found = find(term.loss.program)) return found;
  }
  return nullptr;
}
std::deque<SolveNote> Rollout::adjoint_solve_notes() const {
  std::deque<SolveNote> notes;
  if (impl_->back) append(notes, impl_->back->adjoint.program());
  for (BoundTerm& term : impl_->losses.terms()) {
    if (term.adjoint) append(notes, term.adjoint->program);
  }
  return notes;
}
int Rollout::block_steps() const { return impl_->stepper.block_steps(); }
std::string Rollout::tuning() const { return impl_->tuning(); }
int Rollout::gradient_block_steps() const { return impl_->back ? impl_->back->legs.block_steps() : 1; }
int Rollout::state_count() const { return static_cast<int>(impl_->states.count()); }
const std::string& Rollout::state_name(int state) const {
  return impl_->setup.values().name(impl_->states.ids().now[static_cast<size_t>(state)]);
}
int Rollout::state_index(std::string_view name) const {
  return impl_->states.index_of(impl_->setup.values().find(name));
}
void Rollout::update_weights() { impl_->update_weights(); }
Field& Rollout::initial(int state) { return impl_->states.initial(static_cast<size_t>(state)); }

bool Rollout::set_param(std::string_view name, double value) {
  bool found = false;
  const ValueId id = impl_->setup.values().find(name);
  impl_->for_each_program([&](BoundProgram& program) {
    const int param = impl_->setup.ids(program.executor.program()).param(id);
    if (param < 0) return;
    program.executor.set_param(param, value);  // uniforms may cost as much as a step: computed in the next run
    found = true;
  });
  return found;
}

void Rollout::set_begin(double t0) { impl_->inputs.set_begin(t0); }
const StepRecord& Rollout::record() const { return impl_->stepper.control().parts(); }
void Rollout::follow(const StepRecord* record) { impl_->stepper.control().follow(record); }
const StepController& Rollout::controller() const { return impl_->stepper.control().state(); }
void Rollout::set_controller(const StepController& controller) { impl_->stepper.control().set_state(controller); }
void Rollout::set_control(std::string_view name, int every, std::span<const double> values) {
  impl_->set_control(name, every, values);
}

RunResult Rollout::run(const Observer& observer, int first) { return impl_->run(observer, first); }
const std::vector<void*>& Rollout::final_states() const { return impl_->forward.final_states(); }
void Rollout::restart(int step) {
  impl_->update_weights();
  impl_->forward.restart(step);
}
RunResult Rollout::advance(int steps, bool until_steady) {
  const FloatScope without_subnormals;
  const auto start = std::chrono::steady_clock::now();
  RunResult done = impl_->forward.advance(steps, until_steady);
  done.seconds = seconds_since(start);
  return done;
}
const std::vector<void*>& Rollout::present() const { return impl_->forward.final_states(); }
double Rollout::loss() { return impl_->loss(); }
const GradientResult& Rollout::gradient() {
  // Only this run decides whether a solution has a derivative, not earlier runs with other values.
  const auto forget = [](BoundProgram& program) {
    for (SolveNote& note : program.executor.solve_notes()) {
      note.out_of_reach.of_least_squares = 0;
      note.out_of_reach.made_of.clear();
    }
  };
  forget(impl_->stepper.program());
  for (BoundTerm& term : impl_->losses.terms()) forget(term.loss.program);
  return impl_->gradient();
}
std::vector<std::pair<std::string, double>> Rollout::derivatives_of_averages() {
  std::vector<std::pair<std::string, double>> all;
  impl_->losses.derive_averages([&](std::span<const double> sums, const BoundLossAdjoint& adjoint) {
    for (const ParamBar& param : adjoint.params)
      all.emplace_back(impl_->sums.param_names()[param.param], sums[param.sum]);
  });
  return all;
}
void Rollout::set_weight(std::size_t term, double weight) { impl_->losses.terms()[term].weight = weight; }
const std::vector<std::string>& Rollout::param_bar_names() const { return impl_->sums.param_names(); }
FieldView Rollout::bar_of(std::string_view field) const {
  const ValueId id = impl_->setup.values().find(field);
  const int state = impl_->states.index_of(id);
  return state >= 0 ? impl_->result.state_bars[static_cast<size_t>(state)] : impl_->sums.field_bar(id);
}
void Rollout::copy_field_bar(std::string_view field, std::span<double> to) const {
  if (!impl_->sums.copy_field_bar(impl_->setup.values().find(field), to)) copy_out(bar_of(field), to);
}
void Rollout::copy_param_bar(std::string_view param, std::span<double> to) const {
  impl_->sums.copy_param_bar(impl_->setup.values().find(param), to);
}
void Rollout::copy_rate_bar(std::string_view network, std::span<double> to) const {
  impl_->sums.copy_rate_bar(impl_->setup.values().find(network), to);
}
void Rollout::end_at_rest(bool ends_at_rest) { impl_->steady.end_at_rest(ends_at_rest); }
void Rollout::watch_gradient(GradientCallback call, int every) { impl_->watch.set_callback(std::move(call), every); }
const FarState* Rollout::far_state() const { return impl_->losses.far_state(); }
bool Rollout::was_stopped() const { return impl_->result.stopped; }
double Rollout::adjoint_norm() const { return impl_->back->bars.norm(); }

const std::vector<std::string>& Rollout::sought() const { return impl_->setup.sought; }

}  // namespace dpde
