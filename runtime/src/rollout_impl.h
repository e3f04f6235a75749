// SPDX-License-Identifier: Apache-2.0
// The inside of Rollout: programs with all names resolved, and the memory of states. Inside the runtime only.
#pragma once

#include <chrono>
#include <cstdlib>
#include <string>
#include <vector>

#include "dpde/runtime/checkpoint.h"
#include "dpde/runtime/rollout.h"
#include "wavefront.h"

namespace dpde {

/// All states at one time: one base pointer a state.
using StateBuffer = std::vector<double*>;

/// Equal arrays with one layout in one allocation.
class FieldPool {
 public:
  FieldPool() = default;
  FieldPool(const dpde_layout& layout, int64_t count);
  double* base(int64_t number) const { return memory_.get() + number * stride_ + origin_; }
  /// Elements from one array to the next: shared by all pools of the layout.
  static int64_t stride_of(const dpde_layout& layout);

 private:
  struct Free {
    void operator()(double* memory) const { std::free(memory); }
  };
  std::unique_ptr<double, Free> memory_;
  int64_t stride_ = 0, origin_ = 0;
};

/// A program of the rollout: its executor, where the states enter, and what else has to be set before a run.
struct BoundProgram {
  Executor executor;
  int t_param = -1;
  std::vector<int> states;      // field of each state; -1 when the program does not read it
  std::vector<int> fill_states; // fields of states whose halo the step does not keep filled
  std::vector<int> fill_inputs; // fields of the caller
  FieldPool temporaries;

  void set_time(double t) {
    if (t_param < 0) return;
    executor.set_param(t_param, t);
    executor.update_uniforms();
  }
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

/// The field x_bar of an adjoint and the number of x among the sought fields.
struct FieldBar {
  int field;
  size_t number;
};

struct BoundStep {
  BoundProgram program;
  std::vector<int> next;  // field of each state's next value
  std::optional<Wavefront> block;  // several steps at once
};
struct BoundAdjoint {
  BoundProgram program;
  std::vector<int> seeds, results;  // fields u_next_bar and u_bar of each state
  std::vector<ParamBar> params;
  std::vector<FieldBar> fields;
};
/// Data of a loss: a field and its memory at each entry of at_steps (or the same for all).
struct BoundData {
  int field;
  std::vector<double*> at;
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
};
/// Loss `term` at a step, which is entry `entry` of the term's steps.
struct LossEvent {
  size_t term, entry;
};

struct Rollout::Impl {
  explicit Impl(RolloutSetup from);

  // Preparation (rollout_setup.cpp)
  BoundProgram bind_program(const dpde_program& program, const std::vector<std::string>& own_fields, bool is_step);
  void bind_inputs(BoundProgram& bound, const std::vector<std::string>& own_fields);
  void bind_params(BoundProgram& bound);
  void bind_step();
  void plan_block();
  void bind_adjoint();
  void bind_term(const LossTerm& term);
  std::vector<BoundData> bind_data(const LossTerm& term, BoundProgram& bound);
  std::vector<ParamBar> bind_param_bars(const dpde_program& program);
  std::vector<FieldBar> bind_field_bars(const Executor& executor) const;
  void schedule_losses();
  bool adjoint_reads_states() const;
  void plan_memory();
  template <class Visit>
  void for_each_program(const Visit& visit);

  // Running (rollout.cpp)
  double time(int step) const { return setup.t0 + step * setup.dt; }
  bool stopping() const { return setup.stop != nullptr && setup.stop->load(std::memory_order_relaxed); }
  void begin(int first = 0);
  void step(int n, const StateBuffer& from, const StateBuffer& to);
  int steps_at_once(int n, int until) const;
  void steps(int n, int count, const StateBuffer& from, const StateBuffer& to);
  void bind_buffers(const StateBuffer& from, const StateBuffer& to);
  void add_losses(int k, const StateBuffer& state);
  bool has_losses(int k) const { return first_event[static_cast<size_t>(k)] != first_event[static_cast<size_t>(k) + 1]; }
  int free_buffer(int a, int b) const;
  std::optional<BlowUp> find_blow_up(int step, const StateBuffer& state) const;
  BlowUp locate_blow_up(int from, int safe, const BlowUp& found);
  RunResult run(const Observer& observer, int first);
  void restart();
  RunResult advance(int count);
  double loss();

  // Gradient (rollout_gradient.cpp)
  const GradientResult& gradient();
  bool run_without_trajectory();
  bool run_with_checkpoints();
  void make_frames();
  bool run_frames();
  bool advance(int from, int to);
  bool start_reverse(int n);
  void forward_done();
  int take();
  void release(int buffer);
  void seed_end(const StateBuffer& state);
  void add_seeds(int k, const StateBuffer& state);
  void run_loss_adjoint(const LossEvent& event, int k, const StateBuffer& state);
  void reverse(int n, const StateBuffer& state);
  void bind_reverse(const StateBuffer& state, size_t seeds);
  void prepare_seeds();
  void add_field_bars(const Executor& executor, const std::vector<FieldBar>& fields);
  void after_reverse(int n, const StateBuffer& state);

  RolloutSetup setup;
  std::vector<std::string> state_names, next_names;
  std::vector<Field> initial;
  std::optional<BoundStep> forward;
  std::optional<BoundAdjoint> backward;
  std::vector<BoundTerm> terms;
  std::vector<LossEvent> events;     // in order of their steps
  std::vector<size_t> first_event;   // events of state k: first_event[k] .. first_event[k + 1]
  int last_loss = 0;                 // the last step with a loss: the gradient runs so far
  std::vector<std::string> param_bar_names;

  // Buffers of states: 0 is initial, the others lie in `pool`.
  FieldPool pool;
  std::vector<StateBuffer> buffers;
  StateBuffer final_states;
  double loss_value = 0;
  int reached = 0;  // steps of advance() since restart()

  // Gradient
  bool keeps_trajectory = false;
  std::vector<checkpoint::Action> actions;
  std::vector<int> slot_buffers;
  std::vector<int> free_list;
  std::vector<char> is_stored;  // of each buffer
  // Not empty: all states are stored and the programs have frames, made once: those of step n, and of its adjoint.
  std::vector<double*> step_frames, adjoint_frames;
  int current = 0;              // buffer of the current state
  int front = 0;                // the last state whose losses are counted
  FieldPool bar_pool;
  FieldPool field_bar_pool;       // one a sought field
  std::vector<StateBuffer> bars;  // two, and one for seeds to be added
  std::vector<char> is_seeded;    // of each state
  size_t bar = 0;                 // bars[bar] holds the seeds
  GradientResult result;
  std::chrono::steady_clock::time_point start;
};

}  // namespace dpde
