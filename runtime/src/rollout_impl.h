// SPDX-License-Identifier: Apache-2.0
// The inside of Rollout: programs with all names resolved, and the memory of states. Inside the runtime only.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <string>
#include <vector>

#include "dpde/runtime/communicator.h"
#include "dpde/runtime/float_mode.h"
#include "dpde/runtime/rollout.h"
#include "dpde/runtime/tapes.h"
#include "dpde/runtime/unsolved.h"
#include "field_pool.h"
#include "reversal.h"
#include "solve/krylov.h"
#include "solve/solver_shelf.h"
#include "wavefront.h"

namespace dpde {

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A parameter that has values[n / every] in step n, the last one beyond.
struct Control {
  std::string name;
  int every;
  std::vector<double> values;
  double at(int n) const { return values[control_interval(n, every, values.size())]; }
};

/// A program of the rollout: its executor, where the states enter, and what else has to be set before a run.
struct BoundProgram {
  Executor executor;
  int t_param = -1, dt_param = -1;
  std::vector<std::pair<int, size_t>> controls;        // parameter, and number among the rollout's controls
  std::vector<std::pair<int, size_t>> control_fields;  // field, and number among those of the setup
  std::vector<int> states;                             // field of each state; -1 when the program does not read it
  std::vector<int> fill_states;                        // fields of states whose halo the step does not keep filled
  std::vector<int> fill_inputs;                        // fields of the caller
  FieldPool temporaries;

  void bind_states(const StateBuffer& buffer) {
    for (size_t i = 0; i < states.size(); ++i) {
      if (states[i] >= 0) executor.bind(states[i], buffer[i]);
    }
    for (int field : fill_states) executor.prepare(field);
  }
  void prepare_inputs() {
    for (int field : fill_inputs) executor.prepare(field);
  }
};

/// A sum <param>_bar of a program and its place among the parameter gradients.
struct ParamBar {
  size_t sum, param;
};

/// The field x_bar of an adjoint, the number of x among the sought fields, and where the sum of what steps say of it is
/// kept: a control field has one place an interval, from the first on.
struct FieldBar {
  int field;
  size_t number;
};
struct SoughtField {
  size_t first = 0, count = 1;  // in GradientResult::field_bars
  int every = 0;                // of a control field
  size_t at(int n) const { return every == 0 ? first : first + control_interval(n, every, count); }
};

struct BoundStep {
  BoundProgram program;
  std::vector<int> next;           // field of each state's next value
  std::optional<Wavefront> block;  // several steps at once
  std::optional<Wavefront> leg;    // those whose adjoints are done at once
};
/// The step that keeps fields for its adjoint.
struct BoundKeeping {
  BoundStep step;
  std::vector<std::pair<int, int>> fields;  // what is kept: field of the step, and of its adjoint
  FieldPool pool;                           // all of a step, step by step
  void* at(int n, size_t i) const {
    return pool.base(static_cast<int64_t>(n) * std::ssize(fields) + static_cast<int64_t>(i));
  }
};
/// How fast things move at a state: 1/time, in each cell.
struct BoundRate {
  BoundProgram program;
  int field;
};
struct BoundAdjoint {
  BoundProgram program;
  std::vector<int> seeds, results;  // fields u_next_bar and u_bar of each state
  std::vector<ParamBar> params;
  std::vector<FieldBar> fields, totals;  // whose values are to be added to what is kept; which the program adds to
  int64_t bytes = 0;                     // of its pools
  std::optional<Wavefront> block;        // adjoints of several steps at once
  std::vector<size_t> block_results;     // of its swaps: the state
};
/// Data of a loss: a field and its memory at each entry of at_steps (or the same for all).
struct BoundData {
  int field;
  std::vector<void*> at;
};
struct BoundLoss {
  BoundProgram program;
  int sum = 0;
  std::vector<BoundData> data;
};
struct BoundLossAdjoint {
  BoundProgram program;
  std::vector<int> results;  // field u_bar of each state; -1 when the loss does not depend on it
  std::vector<ParamBar> params;
  std::vector<FieldBar> fields;
  std::vector<BoundData> data;
};
struct BoundTerm {
  double weight;
  BoundLoss loss;
  std::optional<BoundLossAdjoint> adjoint;
  int seed = -1;             // parameter of the adjoint: what the loss weighs
  int average = -1;          // what it adds to in place of the loss
  bool of_averages = false;  // once a run
};
/// What a run's states add up to, and what the losses that are made of it change with it.
struct Average {
  std::string name;
  double value = 0, bar = 0;
};
/// Loss `term`, with its data of `entry`, counts at state `step`.
struct LossEvent {
  int step;
  size_t term, entry;
};

/// The gradient by the weights of a network that is learned, and by their rates.
struct WeightBars {
  std::string network;
  std::vector<double> values, rates;
};

struct Rollout::Impl {
  enum class Purpose { run, plan };  // plan: nothing is bound, and memory is counted only
  explicit Impl(RolloutSetup from, Purpose purpose = Purpose::run);

  // Preparation (rollout_setup.cpp)
  BoundProgram bind_program(const dpde_program& program, const std::vector<std::string>& own_fields, bool is_step);
  void bind_inputs(BoundProgram& bound, const std::vector<std::string>& own_fields);
  void bind_params(BoundProgram& bound);
  void bind_weights(BoundProgram& bound, bool adds = true);
  void place_sought();
  void bind_step();
  void bind_rate();
  void bind_adjoint(const dpde_program& program, std::vector<std::string> own = {});
  void take_total_adjoint();
  std::vector<std::pair<int, int>> kept_by_step() const;
  bool keeps_less_than(const std::vector<char>& read) const;
  void take_kept_adjoint();
  int64_t kept_fields() const { return keeping ? int64_t{last_loss} * std::ssize(keeping->fields) : 0; }
  void bind_term(const LossTerm& term);
  std::vector<BoundData> bind_data(const LossTerm& term, BoundProgram& bound);
  std::vector<ParamBar> bind_param_bars(const dpde_program& program);
  std::vector<FieldBar> bind_field_bars(const Executor& executor) const;
  void schedule_losses();
  std::vector<char> states_read(const dpde_program& adjoint) const;
  void plan_buffers(int slots, const std::vector<char>& read);
  int64_t bytes_of_states() const;
  int plan_slots(const std::vector<char>& read);
  int least_of_ranks(int64_t slots) const;
  int64_t recomputed_steps(int slots);
  void plan_storage();
  void allocate_states();
  FieldPool make_pool(const dpde_layout& layout, int64_t count, const std::string& folder = {});
  template <class Visit>
  void for_each_program(const Visit& visit);
  void set_clocks(GradientSeconds& seconds);
  std::string tuning();
  void set_tuning(std::string_view text);

  // Several steps in one pass over memory (rollout_blocks.cpp)
  void plan_block();
  void plan_reverse_block();
  bool plan_marks();
  int legs() const { return marks.empty() ? last_loss : static_cast<int>(marks.size()) - 1; }
  int mark(int leg) const { return marks.empty() ? leg : marks[static_cast<size_t>(leg)]; }
  void run_block(Wavefront& block, int n, const StateBuffer& from, std::span<void* const> results);
  void run_leg(int leg, const StateBuffer& from, const StateBuffer& to);
  void keeping_step(int n, const StateBuffer& from, const StateBuffer& to);
  void reverse_leg(int leg, const StateBuffer& state);

  // Until steady (rollout_steady.cpp)
  double largest_change(const StateBuffer& from, const StateBuffer& to) const;
  bool is_still(const StateBuffer& from, const StateBuffer& to) const;
  bool goes_on_to_steady(int state, bool is_back);
  std::optional<Steady> run_to_steady();
  std::optional<Steady> find_steady_rates();
  bool run_steady_gradient();
  std::vector<double> unrest_of(const StateBuffer& state);
  SteadyAdjoint solve_adjoint(const StateBuffer& state, std::span<const double> unrest);
  bool solve_fixed_point(const VectorFunction& step, std::span<const double> b, std::span<double> x, bool is_back,
                         SteadyAdjoint& report);
  int last_step() const { return std::max(setup.steps - 1, 0); }

  // What networks and solves computed (rollout_tapes.cpp)
  void plan_tapes(int64_t left);
  void record_tapes(bool on);

  // Running (rollout.cpp)
  double time(int step) const { return setup.t0 + step * setup.dt; }
  void set_step(BoundProgram& program, int n, int part = 0, int parts = 1) const {
    set_part(program, n, part_at(n, part, parts));
  }
  void set_part(BoundProgram& program, int n, const PartOfStep& part) const;
  void bind_control_fields(BoundProgram& program, int n) const;
  int end_of_intervals(int n) const;
  void set_control(std::string_view name, int every, std::span<const double> values);
  bool stopping() const {
    return setup.stop != nullptr && largest_of(setup.ranks, setup.stop->load(std::memory_order_relaxed) ? 1 : 0) > 0;
  }
  void begin(int first = 0);
  void update_weights();
  void step(int n, const StateBuffer& from, const StateBuffer& to);
  int steps_at_once(int n, int until) const;
  void run_in_step(Executor& executor, int n, double begin = 0) const;
  void run_at_state(Executor& executor, int k) const;
  void steps(int n, int count, const StateBuffer& from, const StateBuffer& to);
  static void bind_buffers(BoundStep& step, const StateBuffer& from, const StateBuffer& to);
  void add_losses(int k, const StateBuffer& state) { add_losses(events_at(k), k, state); }
  void add_losses(std::span<const LossEvent> due, int k, const StateBuffer& state);
  void look_at_growth(int k, const StateBuffer& state);

  // Losses of averages over the states (rollout_averages.cpp)
  int average_called(const std::string& name);
  void begin_averages();
  void give_averages(BoundProgram& program);
  void add_losses_of_averages();
  void derive_averages(const std::function<void(std::span<const double> sums, const BoundLossAdjoint&)>& take);
  void seed_averages();
  /// Steps are asked for one after the other, in either direction: the place in the list is kept, nothing is searched.
  std::span<const LossEvent> events_at(int k) {
    while (next_event > 0 && events[next_event - 1].step >= k) --next_event;
    while (next_event < events.size() && events[next_event].step < k) ++next_event;
    size_t end = next_event;
    while (end < events.size() && events[end].step == k) ++end;
    return {events.data() + next_event, end - next_event};
  }
  bool has_losses(int k) { return !events_at(k).empty(); }
  int free_buffer(int a, int b) const;
  std::optional<Cell> find_bad_cell(const void* state, double& value) const;
  std::optional<BlowUp> find_blow_up(int step, const StateBuffer& state) const;
  BlowUp locate_blow_up(int from, int safe, const BlowUp& found);
  RunResult run(const Observer& observer, int first);
  void restart();
  RunResult advance(int count);
  double loss();

  // Steps in parts (rollout_parts.cpp)
  /// A Courant number, a tolerance, or the parts of another rollout.
  bool has_parts() const { return rate || setup.trial != nullptr || setup.follows; }
  const StepRecord& steps_made() const { return followed != nullptr ? *followed : record; }
  PartOfStep part_at(int n, int part, int parts) const {
    if (parts > 1 && !rate) return steps_made().of(n)[static_cast<size_t>(part)];
    return {part * (setup.dt / parts), setup.dt / parts};
  }
  void begin_record(int first);
  int parts_of(int n, const StateBuffer& state);
  void part_of_step(int n, const PartOfStep& part, const StateBuffer& from, const StateBuffer& to);
  void show_part(int n, const PartOfStep& part, const StateBuffer& state) const;
  const StateBuffer& part_buffer(int part);
  double estimate_part(int n, const PartOfStep& part, const StateBuffer& from, const StateBuffer& to,
                       std::optional<Unsolved>& unsolved);
  void step_under_tolerance(int n, const StateBuffer& from, const StateBuffer& to);
  void check_parts(int n, const PartOfStep& next, size_t made, const std::optional<Unsolved>& unsolved) const;
  [[noreturn]] void fail_in_parts(int n, double t, const std::string& why, const char* advice) const;

  // Gradient (rollout_gradient.cpp)
  const GradientResult& gradient();
  class Recording;
  bool run_trajectory_gradient();
  bool run_without_trajectory();
  bool run_with_checkpoints();
  void make_frames();
  bool run_frames();
  bool start_reverse(int leg, const StateBuffer& state, const StateBuffer& last);
  void forward_done();
  void seed_end(const StateBuffer& state, int k);
  void add_seeds(int k, const StateBuffer& state);
  void run_loss_adjoint(const LossEvent& event, int k, const StateBuffer& state);
  void reverse(int n, const StateBuffer& state);
  void reverse_step(int n, const StateBuffer& state);
  void reverse_parts(int n, int parts, const StateBuffer& state);
  void reverse_part(int n, int part, int parts, const StateBuffer& state);
  void bind_reverse(const StateBuffer& state, size_t seeds);
  void prepare_seeds();
  void drop_adjoints(int state);
  void add_param_bars(std::span<const double> sums, const std::vector<ParamBar>& params, int n);
  void add_field_bars(const Executor& executor, const std::vector<FieldBar>& fields, int n);
  void bind_kept(int n);
  void bind_totals(int n);
  void flush_totals(int n);
  void after_reverse(int n);
  class WithoutSums;
  void add_to_gradient(bool adds);
  /// Counts steps of a gradient, forward or back, that led to `state`, or of `total`; false when whoever watches wants
  /// no more.
  bool go_on(int state, int worked = 1, bool is_back = false);
  bool go_on(int state, int worked, int64_t total, bool is_back);
  double adjoint_norm() const;
  FieldView bar_of(std::string_view field) const;
  void copy_field_bar(std::string_view field, std::span<double> to) const;
  void copy_param_bar(std::string_view param, std::span<double> to) const;
  void copy_rate_bar(std::string_view network, std::span<double> to) const;

  RolloutSetup setup;
  const Purpose purpose;
  std::vector<std::string> state_names, next_names;
  std::vector<char> is_rate;  // of each state: see RolloutSetup::rates
  std::vector<Field> initial;
  std::shared_ptr<SolverStore> solvers;  // of all programs
  int64_t bytes_of_fields = 0;           // of all pools in memory, and the initial states
  std::vector<OwnedMemory> owned;        // by the programs beside these
  std::optional<BoundStep> forward;
  std::optional<BoundKeeping> keeping;  // `backward` reads what it keeps
  std::optional<BoundRate> rate;
  std::vector<FieldPool>
      part_pools;  // states between the parts of a step: two to work in, and in gradient() those that are stored
  std::deque<StateBuffer> part_buffers;  // a deque: buffers in use stay where they are
  int64_t parts_made = 0, parts_refused = 0;
  const Observer* observer_of_parts = nullptr;  // of the run that is being made
  StepRecord record;
  const StepRecord* followed = nullptr;
  StepController controller;
  int part_slots = 1, planned_parts = 0;  // how many may be stored; for how many parts the plan is
  Reversal part_reversal;
  int64_t planned_bytes = 0;  // of checkpoints, without those of parts
  std::optional<BoundAdjoint> backward;
  std::vector<BoundTerm> terms;
  std::vector<Average> averages;
  std::vector<LossEvent> events;  // in order of their steps; not a list over all steps, of which there may be 1e9
  size_t next_event = 0;          // of those at or behind the step that was asked for last
  int last_loss = 0;              // the last step with a loss: the gradient runs so far
  std::vector<std::string> param_bar_names;
  std::deque<WeightBars> weight_bars;
  std::vector<Control> controls;
  std::vector<int> control_every;  // steps an interval, for those of param_bar_names that are controls

  // Buffers of states: 0 is initial, the others lie in `pool`.
  int64_t buffer_count = 0;
  FieldPool pool;
  std::vector<int64_t> buffers_of_state;  // how many there are of each state
  std::vector<StateBuffer> buffers;
  StateBuffer final_states;
  std::optional<FarState> far;    // see far_state()
  std::vector<Field> far_fields;  // its memory, once there is one
  double loss_value = 0;
  int reached = 0;  // steps of advance() since restart()

  // Gradient. It goes in legs, from state mark(i) to mark(i + 1), of one step or of those of a block; not empty: marks.
  std::vector<int> marks;
  std::vector<void*> leg_results;
  std::vector<double*> leg_totals;  // of the sought fields, in the intervals of the leg
  bool keeps_trajectory = false;
  Reversal reversal;
  // Not empty: all states are stored and the programs have frames, made once: those of step n, and of its adjoint.
  std::vector<void*> step_frames, adjoint_frames;
  int current = 0;  // buffer of the current state
  int front = 0;    // the last state whose losses are counted
  FieldPool bar_pool;
  FieldPool field_bar_pool;         // one a sought field, or one an interval of it
  std::vector<SoughtField> sought;  // where they are
  dpde_layout bar_layout{};         // of field_bar_pool: that of the states, but of doubles
  FieldPool single_totals;          // in single precision: what a few steps have added up
  int single_steps = 0;             // how many
  std::vector<StateBuffer> bars;    // two, and one for seeds to be added
  std::vector<char> is_seeded;      // of each state
  bool adds_bars = true;            // gradients of parameters, fields and weights, in the adjoint of a step
  size_t bar = 0;                   // bars[bar] holds the seeds
  std::vector<std::shared_ptr<Tapes>> tapes;
  GradientCallback watch;
  int watch_every = 1;
  FloatMode host_mode = 0;   // of whoever asked for the gradient or loss, for `watch`
  int64_t steps_worked = 0;  // of this gradient, in any direction, or loss
  GradientResult result;
  std::chrono::steady_clock::time_point start;
};

/// While it lives the adjoint of a step is a product alone: nothing is added to the gradient, by the rollout or by the
/// program itself.
class Rollout::Impl::WithoutSums {
 public:
  explicit WithoutSums(Impl& rollout) : rollout_(rollout) { rollout_.add_to_gradient(false); }
  ~WithoutSums() { rollout_.add_to_gradient(true); }
  WithoutSums(const WithoutSums&) = delete;
  WithoutSums& operator=(const WithoutSums&) = delete;

 private:
  Impl& rollout_;
};

template <class Visit>
void Rollout::Impl::for_each_program(const Visit& visit) {
  visit(forward->program);
  if (keeping) visit(keeping->step.program);
  if (rate) visit(rate->program);
  if (backward) visit(backward->program);
  for (BoundTerm& term : terms) {
    visit(term.loss.program);
    if (term.adjoint) visit(term.adjoint->program);
  }
}

}  // namespace dpde
