// SPDX-License-Identifier: Apache-2.0
// The gradient: forward by the checkpoint plan, then the adjoint back, with the seeds of the losses added at their
// steps.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "dpde/runtime/error.h"
#include "rollout_impl.h"

namespace dpde {
namespace {

constexpr int most_single_steps = 16;

void check_adjoints(bool has_step_adjoint, const std::vector<BoundTerm>& terms) {
  if (!has_step_adjoint) throw Error(ErrorKind::run, "the gradient needs the adjoint of the step");
  for (const BoundTerm& term : terms) {
    if (term.adjoint || term.average >= 0) continue;  // averages may be of data alone
    throw Error(ErrorKind::run, fmt::format("the gradient needs the adjoint of the loss {}",
                                            term.loss.program.executor.program().name));
  }
}

}  // namespace

const GradientResult& Rollout::Impl::gradient() {
  check_adjoints(backward.has_value(), terms);
  const FloatScope without_subnormals;
  host_mode = without_subnormals.before();
  start = std::chrono::steady_clock::now();
  begin();
  begin_averages();
  set_step(backward->program, std::max(last_loss - 1, 0));
  backward->program.prepare_inputs();
  std::ranges::fill(result.param_bars, 0.0);
  for (WeightBars& of_network : weight_bars) {
    std::ranges::fill(of_network.values, 0.0);
    std::ranges::fill(of_network.rates, 0.0);
  }
  for (std::vector<double>& bars_of_control : result.control_bars) std::ranges::fill(bars_of_control, 0.0);
  for (size_t i = 0; i < result.field_bars.size(); ++i) {
    fill_all(bar_layout, field_bar_pool.base(static_cast<int64_t>(i)), 0.0);
  }
  for (size_t i = 0; i < backward->totals.size() && setup.layout.real == DPDE_F32; ++i)
    fill_all(setup.layout, single_totals.base(static_cast<int64_t>(i)), 0.0);
  single_steps = 0;
  loss_value = 0;
  current = front = 0;
  bar = 0;
  steps_worked = 0;
  const bool complete = setup.steady > 0 ? run_steady_gradient() : run_trajectory_gradient();
  result.stopped = !complete;
  result.loss = loss_value;
  for (size_t i = 0; i < state_names.size(); ++i) result.state_bars[i] = {&setup.layout, bars[bar][i]};
  result.checkpoint_bytes = planned_bytes + static_cast<int64_t>(part_buffers.size() * state_names.size()) *
                                                FieldPool::stride_of(setup.layout);
  result.total_seconds = seconds_since(start);
  return result;
}

/// While it lives tapes record; not any more where a step has no solution.
class Rollout::Impl::Recording {
 public:
  explicit Recording(Impl& rollout) : rollout_(rollout) { rollout_.record_tapes(true); }
  ~Recording() { rollout_.record_tapes(false); }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

 private:
  Impl& rollout_;
};

bool Rollout::Impl::run_trajectory_gradient() {
  const Recording recording(*this);
  add_losses(0, buffers.front());
  return !step_frames.empty() ? run_frames() : keeps_trajectory ? run_with_checkpoints() : run_without_trajectory();
}

bool Rollout::Impl::go_on(int state, int worked, bool is_back) {
  return go_on(state, worked, 2 * int64_t{last_loss} + result.recomputed_steps, is_back);
}

bool Rollout::Impl::go_on(int state, int worked, int64_t total, bool is_back) {
  const int64_t before = std::exchange(steps_worked, steps_worked + worked);
  if (!watch || (before / watch_every == steps_worked / watch_every && steps_worked != total)) return true;
  const FloatScope of_host(host_mode);
  return largest_of(setup.ranks, watch({steps_worked, total, time(state), is_back}) ? 0 : 1) == 0;
}

/// By rows in extended range: adjoints of chaotic runs grow without bounds, and their squares twice as far.
double Rollout::Impl::adjoint_norm() const {
  const dpde_layout& layout = setup.layout;
  const auto cells = [&](int axis) { return axis < layout.rank ? layout.cells[axis] : 1; };
  long double sum = 0;
  for (const void* base : bars[bar]) {
    for (int64_t z = 0; z < cells(2); ++z) {
      for (int64_t y = 0; y < cells(1); ++y) {
        for (int64_t x = 0; x < cells(0); ++x) {
          const long double value = value_at(layout, base, {x, y, z});
          sum += value * value;
        }
      }
    }
  }
  const auto own = static_cast<double>(std::sqrt(sum));
  const double most = largest_of(setup.ranks, own);
  if (setup.ranks == nullptr || most == 0) return own;
  double part = own / most * (own / most);
  setup.ranks->sum({&part, 1});
  return most * std::sqrt(part);
}

FieldView Rollout::Impl::bar_of(std::string_view field) const {
  const auto state = std::ranges::find(state_names, field);
  if (state != state_names.end()) return result.state_bars[static_cast<size_t>(state - state_names.begin())];
  const auto found = std::ranges::find(setup.sought, field);
  return found == setup.sought.end()
             ? FieldView{}
             : result.field_bars[sought[static_cast<size_t>(found - setup.sought.begin())].first];
}

void Rollout::Impl::copy_field_bar(std::string_view field, std::span<double> to) const {
  const auto found = std::ranges::find(setup.sought, field);
  if (found == setup.sought.end()) return copy_out(bar_of(field), to);
  const SoughtField& of = sought[static_cast<size_t>(found - setup.sought.begin())];
  const size_t size = to.size() / of.count;
  for (size_t i = 0; i < of.count; ++i) copy_out(result.field_bars[of.first + i], to.subspan(i * size, size));
}

void Rollout::Impl::copy_param_bar(std::string_view param, std::span<double> to) const {
  std::ranges::fill(to, 0.0);
  const auto network = std::ranges::find(weight_bars, param, &WeightBars::network);
  if (network != weight_bars.end()) {
    std::ranges::copy(network->values, to.begin());
    return;
  }
  const auto found = std::ranges::find(param_bar_names, param);
  if (found == param_bar_names.end()) return;
  const auto number = static_cast<size_t>(found - param_bar_names.begin());
  const std::vector<double>& of_control = result.control_bars[number];
  if (of_control.empty()) {
    to[0] = result.param_bars[number];
  } else {
    std::ranges::copy(of_control, to.begin());
  }
}

void Rollout::Impl::copy_rate_bar(std::string_view network, std::span<double> to) const {
  std::ranges::fill(to, 0.0);
  const auto bars = std::ranges::find(weight_bars, network, &WeightBars::network);
  if (bars != weight_bars.end()) std::ranges::copy(bars->rates, to.begin());
}

void Rollout::Impl::forward_done() { result.forward_seconds = seconds_since(start); }

/// When neither the adjoint of the step nor that of an earlier loss reads a state. False when stopped.
bool Rollout::Impl::run_without_trajectory() {
  for (int leg = 0; leg < legs(); ++leg) {
    if (stopping()) return false;
    const int next = free_buffer(current, current), end = mark(leg + 1);
    run_leg(leg, buffers[static_cast<size_t>(current)], buffers[static_cast<size_t>(next)]);
    current = next;
    if (has_losses(end)) add_losses(end, buffers[static_cast<size_t>(current)]);
    if (!go_on(end, end - mark(leg))) return false;
  }
  forward_done();
  const StateBuffer& last = buffers[static_cast<size_t>(current)];
  seed_end(last, last_loss);
  for (int leg = legs() - 1; leg >= 0; --leg) {
    if (stopping()) return false;
    reverse_leg(leg, last);
    if (!go_on(mark(leg), mark(leg + 1) - mark(leg), true)) return false;
  }
  return true;
}

bool Rollout::Impl::run_with_checkpoints() {
  if (last_loss == 0) {
    forward_done();
    seed_end(buffers.front(), last_loss);
  }
  const auto buffer = [this](int i) -> const StateBuffer& { return buffers[static_cast<size_t>(i) + 1]; };
  const auto advance = [this](int leg, const StateBuffer& from, const StateBuffer& to) {
    if (stopping()) return false;
    const int end = mark(leg + 1);
    run_leg(leg, from, to);
    if (!go_on(end, end - mark(leg))) return false;
    if (end <= front) return true;
    front = end;
    if (has_losses(front)) add_losses(front, to);
    return true;
  };
  const auto reverse = [&](int leg, const StateBuffer& state) {
    if (stopping() || !start_reverse(leg, state, reversal.unused(buffer))) return false;
    reverse_leg(leg, state);
    return go_on(mark(leg), 2 * (mark(leg + 1) - mark(leg)) - 1, true);
  };
  return reversal.run(buffers.front(), buffer, advance, reverse);
}

/// The first reversal is that of the last leg: makes its steps, to `last`, counts its losses, and sets the seeds.
bool Rollout::Impl::start_reverse(int leg, const StateBuffer& state, const StateBuffer& last) {
  if (front == last_loss) return true;
  run_leg(leg, state, last);
  front = last_loss;
  add_losses(last_loss, last);
  forward_done();
  seed_end(last, last_loss);
  return go_on(last_loss, last_loss - mark(leg));
}

/// The losses of the last state, which is the state `k`.
void Rollout::Impl::seed_end(const StateBuffer& state, int k) {
  std::ranges::fill(is_seeded, char{0});
  seed_averages();
  for (const LossEvent& event : events_at(last_loss)) run_loss_adjoint(event, k, state);
  for (size_t i = 0; i < is_seeded.size(); ++i) {
    if (is_seeded[i]) continue;
    fill_all(setup.layout, bars[bar][i], 0.0);
    is_seeded[i] = 1;
  }
}

/// Adds the derivative of the losses at state k to the seeds; the first at the end writes them.
void Rollout::Impl::add_seeds(int k, const StateBuffer& state) {
  for (const LossEvent& event : events_at(k)) run_loss_adjoint(event, k, state);
}

void Rollout::Impl::run_loss_adjoint(const LossEvent& event, int k, const StateBuffer& state) {
  if (!terms[event.term].adjoint) return;
  BoundLossAdjoint& adjoint = *terms[event.term].adjoint;
  BoundProgram& program = adjoint.program;
  for (const BoundData& data : adjoint.data) program.executor.bind(data.field, data.at[event.entry]);
  for (size_t i = 0; i < is_seeded.size(); ++i) {
    if (adjoint.results[i] >= 0) program.executor.bind(adjoint.results[i], is_seeded[i] ? bars[2][i] : bars[bar][i]);
  }
  set_step(program, k);
  program.bind_states(state);
  program.prepare_inputs();
  run_at_state(program.executor, k);
  for (size_t i = 0; i < is_seeded.size(); ++i) {
    if (adjoint.results[i] < 0) continue;
    if (is_seeded[i]) add_interior(setup.layout, bars[bar][i], {&setup.layout, bars[2][i]}, setup.team);
    is_seeded[i] = 1;
  }
  add_param_bars(program.executor.sums(), adjoint.params, k);
  add_field_bars(program.executor, adjoint.fields, k);
}

/// Of a control the share of step n goes to its interval.
void Rollout::Impl::add_param_bars(std::span<const double> sums, const std::vector<ParamBar>& params, int n) {
  for (const ParamBar& param : params) {
    std::vector<double>& bars_of_control = result.control_bars[param.param];
    if (bars_of_control.empty()) {
      result.param_bars[param.param] += sums[param.sum];
    } else {
      bars_of_control[control_interval(n, control_every[param.param], bars_of_control.size())] += sums[param.sum];
    }
  }
}

/// Of a control field, too.
void Rollout::Impl::add_field_bars(const Executor& executor, const std::vector<FieldBar>& fields, int n) {
  for (const FieldBar& bar_of : fields) {
    add_interior(bar_layout, field_bar_pool.base(static_cast<int64_t>(sought[bar_of.number].at(n))),
                 {&setup.layout, executor.bound(bar_of.field)}, setup.team);
  }
}

/// What the adjoint of step n adds to.
void Rollout::Impl::bind_totals(int n) {
  for (size_t i = 0; i < backward->totals.size(); ++i) {
    const FieldBar& total = backward->totals[i];
    void* const to = setup.layout.real == DPDE_F32
                         ? single_totals.base(static_cast<int64_t>(i))
                         : field_bar_pool.base(static_cast<int64_t>(sought[total.number].at(n)));
    backward->program.executor.bind(total.field, to);
  }
}

/// Singles are added up as such over a few steps, in which that is as good as the values are, and then as doubles.
void Rollout::Impl::flush_totals(int n) {
  const bool ends = std::ranges::any_of(backward->totals, [&](const FieldBar& total) {
    return n == 0 || sought[total.number].at(n) != sought[total.number].at(n - 1);
  });
  if (++single_steps < most_single_steps && !ends) return;
  add_field_bars(backward->program.executor, backward->totals, n);
  for (const FieldBar& total : backward->totals)
    fill_all(setup.layout, backward->program.executor.bound(total.field), 0.0);
  single_steps = 0;
}

/// bars[seeds] are the seeds, the other one the result.
void Rollout::Impl::bind_reverse(const StateBuffer& state, size_t seeds) {
  backward->program.bind_states(state);
  for (size_t i = 0; i < state.size(); ++i) {
    backward->program.executor.bind(backward->seeds[i], bars[seeds][i]);
    backward->program.executor.bind(backward->results[i], bars[1 - seeds][i]);
  }
}

/// The adjoint of step n, which begins with `state`.
void Rollout::Impl::reverse_step(int n, const StateBuffer& state) {
  const int parts = parts_of(n, state);
  const bool reads_states = std::ranges::any_of(backward->program.states, [](int field) { return field >= 0; });
  if (parts > 1 && reads_states) {
    reverse_parts(n, parts, state);
  } else {
    for (int part = parts; part-- > 0;) reverse_part(n, part, parts, state);
  }
}

/// And the losses at its first state.
void Rollout::Impl::reverse(int n, const StateBuffer& state) {
  reverse_step(n, state);
  drop_adjoints(n);
  if (has_losses(n)) add_seeds(n, state);
}

/// Of a state that lies on a cut, before the losses at it add theirs.
void Rollout::Impl::drop_adjoints(int state) {
  if (setup.cut <= 0 || state == 0 || state % setup.cut != 0) return;
  for (void* bar_of_state : bars[bar]) fill_all(setup.layout, bar_of_state, 0.0);
}

/// The states between the parts of a step are computed again, by a checkpoint plan of their own.
void Rollout::Impl::reverse_parts(int n, int parts, const StateBuffer& state) {
  if (planned_parts != parts) {
    part_reversal = Reversal(parts, std::min(parts, part_slots));
    planned_parts = parts;
  }
  const auto advance = [&](int part, const StateBuffer& from, const StateBuffer& to) {
    part_of_step(n, part_at(n, part, parts), from, to);
    return true;
  };
  const auto reverse = [&](int part, const StateBuffer& at) {
    reverse_part(n, part, parts, at);
    return true;
  };
  part_reversal.run(
      state, [this](int i) -> const StateBuffer& { return part_buffer(i); }, advance, reverse);
}

void Rollout::Impl::reverse_part(int n, int part, int parts, const StateBuffer& state) {
  set_step(backward->program, n, part, parts);
  bind_kept(n);
  bind_totals(n);
  bind_reverse(state, bar);
  if (part + 1 == parts && (setup.steady > 0 || has_losses(n + 1))) prepare_seeds();
  run_in_step(backward->program.executor, n, part_at(n, part, parts).begin);
  after_reverse(n);
}

/// The halos of seeds that the losses have written or changed.
void Rollout::Impl::prepare_seeds() {
  for (int seed : backward->seeds) backward->program.executor.prepare(seed);
}

/// Whether the adjoint of a step adds to the gradient: the rollout its sums and fields, the program that of weights.
void Rollout::Impl::add_to_gradient(bool adds) {
  adds_bars = adds;
  bind_weights(backward->program, adds);
}

void Rollout::Impl::after_reverse(int n) {
  bar = 1 - bar;
  if (!adds_bars) return;
  add_param_bars(backward->program.executor.sums(), backward->params, n);
  add_field_bars(backward->program.executor, backward->fields, n);
  if (setup.layout.real == DPDE_F32 && !backward->totals.empty()) flush_totals(n);
}

/// When all states are stored (state k in buffer k) the pointers of every run are known beforehand.
void Rollout::Impl::make_frames() {
  Executor &step = forward->program.executor, &adjoint = backward->program.executor;
  const size_t step_size = step.frame_size(), adjoint_size = adjoint.frame_size(),
               steps = static_cast<size_t>(last_loss);
  const bool stores_all = keeps_trajectory && result.recomputed_steps == 0;
  if (has_parts() || keeping || !stores_all || step_size == 0 || adjoint_size == 0 ||
      !backward->program.fill_states.empty())
    return;
  step_frames.resize(steps * step_size);
  adjoint_frames.resize(steps * adjoint_size);
  for (size_t n = 0; n < steps; ++n) {
    bind_control_fields(forward->program, static_cast<int>(n));
    bind_control_fields(backward->program, static_cast<int>(n));
    bind_buffers(*forward, buffers[n], buffers[n + 1]);
    step.make_frame(&step_frames[n * step_size]);
    bind_totals(static_cast<int>(n));
    bind_reverse(buffers[n], (steps - 1 - n) % 2);
    adjoint.make_frame(&adjoint_frames[n * adjoint_size]);
  }
}

/// The same as run_with_checkpoints, with frames.
bool Rollout::Impl::run_frames() {
  BoundProgram &step = forward->program, &adjoint = backward->program;
  const void* const* frame_end = step_frames.data() + step_frames.size();
  int n = 0;
  for (void** frame = step_frames.data(); frame != frame_end; frame += step.executor.frame_size(), ++n) {
    if (stopping()) return false;
    set_step(step, n);
    step.executor.run_frame(frame);
    if (has_losses(n + 1)) add_losses(n + 1, buffers[static_cast<size_t>(n) + 1]);
    if (!go_on(n + 1)) return false;
  }
  forward_done();
  seed_end(buffers[static_cast<size_t>(n)], last_loss);
  void** frame = adjoint_frames.data() + adjoint_frames.size();
  while (n-- > 0) {
    if (stopping()) return false;
    frame -= adjoint.executor.frame_size();
    const StateBuffer& state = buffers[static_cast<size_t>(n)];
    set_step(adjoint, n);
    if (has_losses(n + 1)) {
      bind_reverse(state, bar);
      prepare_seeds();
    }
    adjoint.executor.run_frame(frame);
    after_reverse(n);
    drop_adjoints(n);
    if (has_losses(n)) add_seeds(n, state);
    if (!go_on(n, 1, true)) return false;
  }
  return true;
}

}  // namespace dpde
