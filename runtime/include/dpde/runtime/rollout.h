// SPDX-License-Identifier: Apache-2.0
// Steps a program through time, with losses at chosen steps, and computes the gradient by running its adjoint back.
//
//  - State k is the state after k steps, at the time t0 + k * dt; state 0 is initial().
//  - loss = sum over terms and their steps k of weight * (sum `loss` of the term's program at state k).
//  - The gradient is the exact adjoint of the loop; it is bit-identical for every number of checkpoint slots and
//    threads. Where the adjoints of several steps are done in one pass (block_steps), states are stored between
//    blocks only.
//  - In single precision states and their adjoints are floats; what is added up over steps (losses, gradients of
//    parameters and of sought fields) is added up in doubles.
//  - All memory is allocated in the constructor; run(), loss() and gradient() allocate nothing of the size of a
//    field, but for the states between the parts of steps that a Courant number splits, and a state far above where
//    the run began (far_state()): those once, when they are first needed.
//
// The step program swaps (u, u_next); its adjoint reads u (when it needs it) and the seeds of u_next and swaps these
// with the adjoint of u; a loss adjoint reads the seed of the loss (see LossTerm::sum), a parameter, and keeps the
// adjoint of u. Sums of both are the gradient with respect to parameters. Which is which say the adjoints' links
// (dpde/runtime/links.h), no names. Parameters `t` (time at the start of the step, or of the loss's state) are set by
// the rollout; all others by the caller. A field of the caller that is `sought` has its gradient kept by those adjoints
// that depend on it; the rollout adds up what all steps and losses contribute.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/error.h"
#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/progress.h"
#include "dpde/runtime/reached.h"
#include "dpde/runtime/unsolved.h"

namespace dpde {

/// A field of the caller: coefficients, coordinates, data. Its memory must outlive the rollout; its interior may change
/// between calls; its halo is filled as the programs that read it demand, whenever they are about to run.
struct BoundField {
  std::string name;
  void* base = nullptr;
  std::shared_ptr<const void> keep = nullptr;  // of memory that its owner may give back before
};
/// A field of the caller that is another one in each interval: at[n / every] in step n and in losses at state n, the
/// last one beyond. It is among RolloutSetup::fields too.
struct ControlField {
  std::string name;
  int every = 1;
  std::vector<void*> at;
};
struct BoundParam {
  std::string name;
  double value = 0;
};
/// The weights of a network, in its order, and their rates for tangents. They must stay, and may change between calls.
struct BoundWeights {
  std::string network;
  const double* values = nullptr;
  const double* rates = nullptr;            // null: 0
  bool learned = false;                     // gradient() computes d loss / d weights, where the adjoints have it
  const dpde_host_network* host = nullptr;  // of a network that the host computes
};
/// An input of a loss program that is neither state nor one of RolloutSetup::fields: one pointer for all steps, or one
/// for each entry of at_steps.
struct LossData {
  std::string name;
  std::vector<void*> at;
};
struct LossTerm {
  const dpde_program* loss = nullptr;
  const dpde_program* adjoint = nullptr;  // may be null when no gradient is asked for
  std::vector<int> at_steps;              // strictly increasing, 0 .. steps
  double weight = 1;
  std::vector<LossData> data;
  std::string sum;           // the one that counts; "": the program's only one
  std::string average = {};  // not "": see dpde_loss
  bool of_averages = false;
};

/// Which of `count` intervals of `every` steps step n, or the state after n steps, lies in; the last one beyond.
inline std::size_t control_interval(std::int64_t n, int every, std::size_t count) {
  return std::min(static_cast<std::size_t>(std::max<std::int64_t>(n, 0) / every), count - 1);
}

/// A part of a step: where it begins, from the begin of the step, and how long it is.
struct PartOfStep {
  double begin = 0, length = 0;
};
/// The parts of steps under a tolerance, one step after the other.
struct StepRecord {
  int first = 0;  // number of the first step
  std::vector<PartOfStep> parts;
  std::vector<std::size_t> ends;  // of the steps, in `parts`

  void begin(int step) {
    first = step;
    parts.clear();
    ends.clear();
  }
  bool has(int step) const { return step >= first && static_cast<std::size_t>(step - first) < ends.size(); }
  /// @throws Error(run) where that step is not in it.
  std::span<const PartOfStep> of(int step) const {
    if (!has(step)) throw Error(ErrorKind::run, "the parts of this step are not recorded");
    const auto number = static_cast<std::size_t>(step - first);
    const std::size_t begin = number == 0 ? 0 : ends[number - 1];
    return std::span(parts).subspan(begin, ends[number] - begin);
  }
};
struct RolloutSetup {
  const dpde_program* step = nullptr;
  const dpde_program* adjoint = nullptr;  // null: forward only
  /// The adjoint with bars of sought fields as inputs that it adds to; null: there is none. It takes the place of
  /// `adjoint` where steps are reversed one by one.
  const dpde_program* total_adjoint = nullptr;
  /// The step with results that are no states, and an adjoint that has them as inputs in place of states; null: there
  /// are none. They take the place of both where all states are stored: these results are, step by step.
  const dpde_program* keeping_step = nullptr;
  const dpde_program* kept_adjoint = nullptr;
  dpde_layout layout{};
  int steps = 0;
  double t0 = 0, dt = 0;
  Team team;
  /// Not null: the layout is of a subgrid. All ranks make the same calls; initial(), final_states(), bars of fields and
  /// data are those of the subgrid, losses, bars of parameters, and what a run has met, are the same for all of them.
  Communicator* ranks = nullptr;
  std::shared_ptr<SolverStore> solvers;  // of programs that are run in turns with those of the rollout; empty: its own
  std::vector<BoundField> fields;
  std::vector<BoundParam> params;
  std::vector<ControlField> control_fields;
  std::vector<BoundWeights> weights;
  std::vector<std::string> sought;  // names among `fields`: gradient() computes d loss / d field for them
  std::vector<LossTerm> losses;
  /// Not null: steps limited by a Courant number. The program keeps the field `rate_field`, speed over spacing added up
  /// over the axes; with r its largest value at the state a step begins with, that step is done as ceil(dt*r/courant)
  /// equal ones. States, losses and controls are those of whole steps. The number of parts has no derivative: it is
  /// constant but at jumps.
  const dpde_program* rate = nullptr;
  std::string rate_field;
  double courant = 1;
  /// Not null: steps under a tolerance. `trial` is `step` with one sum, over all cells the square of the estimated
  /// error over the tolerated one. Each step is done in parts for which the root of its mean is at most 1, of lengths
  /// that a PI controller chooses; what is above 1 is made again, shorter. States, losses and controls are those of
  /// whole steps. Lengths have no derivative: gradients hold them.
  const dpde_program* trial = nullptr;
  int error_order = 1;    // the estimate is length^error_order for short parts
  double first_part = 0;  // the length that is tried first
  bool follows = false;   // the parts will be those of another rollout: follow() says which
  /// > 0: the run ends with the first step in which no value changes by more than that a unit of time. Losses are those
  /// of the state `steps`, which that state is, and the gradient is that of a state which the step leaves as it is,
  /// wherever the run begins: x = S(x, p), by one linear solve with the adjoint of the step (run/forward/steady_run.h).
  /// Where `steps` are not enough loss() and gradient() throw NoSolution.
  double steady = 0;
  /// With `steady`: the states that are rates of the others, by a tangent step. initial() of the others is steady, and
  /// that of the rates is not looked at: they are what the tangent step leaves as they are.
  std::vector<std::string> rates;
  /// Memory for the states of gradient(), working states included, and for what networks computed in as many of its
  /// steps as then fit; slots > 0 overrides it. Where there is room for all steps, states that the way back does not
  /// read are not kept.
  int64_t checkpoint_bytes = std::numeric_limits<int64_t>::max();
  int slots = 0;
  /// Not empty: the states of gradient() lie in a file of this folder.
  std::string checkpoint_folder;
  /// Steps of run(), loss() and gradient() done in one pass over memory (temporal blocking); 0: as many as pay, 1: one.
  /// States and fields of gradients are the same to the last bit; gradients of parameters are added up in another
  /// order. Programs that cannot be blocked run step by step, and so do adjoints between bounded axes.
  int block_steps = 0;
  /// > 0: gradient() leaves out what acts through more than so many steps. The adjoints of the states are dropped at
  /// the states cut, 2*cut, ...; what the losses say of such a state goes on into the steps before it. The steps are
  /// then reversed one by one.
  int cut = 0;
  /// What tuning() of a rollout of the same programs, layout and threads has said; "": nothing is known.
  std::string tuning;
  /// Not null: the time of loss() and gradient() is added to it.
  GradientSeconds* seconds = nullptr;
  /// Looked at before each step; when it becomes true the call returns early with `stopped`.
  const std::atomic<bool>* stop = nullptr;
};

/// Called with the first state, those whose number is a multiple of `every`, and the last one. `states` are base
/// pointers, halos filled.
struct Snapshot {
  int step;
  double t;
  const std::vector<void*>& states;
  bool is_last = false;         // of a run that goes on to its end
  bool is_within_step = false;  // after a part of the step that leads to state `step`
};
struct Observer {
  int every = 0;  // 0: never
  std::function<void(const Snapshot&)> call;
  bool sees_parts = false;  // of steps that are made in parts: the states between them, too
};

struct BlowUp {
  int step;   // number of the first state that is not finite
  double t;   // its time
  int state;  // index of the state field, and its first bad cell, of a subgrid by its number in the grid
  Cell cell;
  double value;
};
/// Where a run until steady has come to.
struct Steady {
  bool is_reached = false;
  int step = 0;  // of the state
  double t = 0;
  double change = 0;  // the largest of a value in the last step, a unit of time
};

/// That a run has come to `last` in all its steps, where more than `enough` still changes.
Unsolved not_steady(const Steady& last, double enough);

struct RunResult {
  std::optional<Steady> steady;  // of runs until steady that were neither stopped nor blown up
  int64_t parts = 0;             // how many steps were made, where a Courant number or a tolerance splits them
  int64_t refused = 0;           // parts whose estimated error was too large
  int steps_done = 0;            // the number of the state that final_states() holds
  bool stopped = false;
  std::optional<BlowUp> blow_up;  // final_states() is then the last finite state
  double seconds = 0;
};

/// The linear solve for the adjoint of a steady state.
struct SteadyAdjoint {
  Steady state;
  int products = 0;     // with the adjoint of the step
  double residual = 0;  // |x_bar - (I - S_x^T)*lambda|/|x_bar|
  double bound = 0;     // to which it came: the tolerance, or rounding
  int64_t bytes = 0;    // of the vectors of the solve
  double unsteady = 0;  // by how much the loss would change to where the state comes to rest, to first order
  double scale = 0;     // sum of |x_bar*x|: by how much it would at most if each value changed by itself
  double unrest() const { return scale == 0 ? 0 : std::abs(unsteady) / scale; }
};

struct GradientResult {
  std::optional<SteadyAdjoint> steady;
  double loss = 0;
  bool stopped = false;               // nothing else is valid then
  std::vector<FieldView> state_bars;  // d loss / d initial(i), valid until the next call
  std::vector<FieldView> field_bars;  // d loss / d sought field, in the order of RolloutSetup::sought, of a control
                                      // field one an interval: always doubles
  std::vector<double> param_bars;     // in the order of param_bar_names()
  std::vector<std::vector<double>> control_bars;  // in that order: of a control one an interval, else none
  int stored_states = 0;                          // checkpoints held beside the initial state
  int64_t recomputed_steps = 0;                   // forward steps beyond the first pass
  int64_t checkpoint_bytes = 0;                   // of the states allocated for gradient(), working states included
  int64_t tape_bytes = 0;                         // of what networks and solves computed, kept for adjoints
  int64_t tapes_used = 0;                         // runs of them that adjoints did not make again
  double forward_seconds = 0, total_seconds = 0;
};

/// What gradient() will store, as in GradientResult, and what it makes again.
struct GradientPlan {
  bool stores_states = false;  // false: the way back reads no state but the last
  int block_steps = 1;         // whose adjoints are done in one pass
  int stored_states = 0;
  int64_t recomputed_steps = 0, checkpoint_bytes = 0;
  int64_t tape_bytes = 0;   // of what networks and solves compute, beside that
  int64_t field_bytes = 0;  // of all states, adjoints and temporaries that a rollout holds in memory, and checkpoints
  int64_t kept_fields = 0;  // stored in place of states, over all steps; see RolloutSetup::keeping_step
  std::vector<OwnedMemory> owned;  // by networks, transforms, solves and repeats of its programs, beside these
};
/// The plan of a rollout of `setup`, made as the rollout makes it. Fields, parameters, weights and data need not be
/// bound, and nothing of the size of a field is allocated.
GradientPlan plan_gradient(RolloutSetup setup);

/// The state of the last losses, where values are `suspicious_growth` times (dpde/runtime/growth.h) above where the run
/// began.
struct FarState {
  std::vector<double> before;  // largest magnitudes where it began
  std::vector<void*> states;   // base pointers, until the next loss() or gradient()
  int step = 0;
  double t = 0;
};

class Rollout {
 public:
  /// @throws Error(input) for steps < 0, losses at steps out of range, a budget that is too small;
  ///         Error(run) naming program and field or parameter for anything that is not bound;
  ///         Error(machine) when memory runs out.
  explicit Rollout(RolloutSetup setup);
  ~Rollout();
  Rollout(Rollout&&) noexcept;
  Rollout& operator=(Rollout&&) noexcept;

  /// Which ways to sweep over large fields were found fastest here, for other rollouts of the same programs, layout and
  /// threads; results do not depend on it.
  std::string tuning() const;

  int state_count() const;
  /// Steps that run() and loss() do in one pass over memory; 1 where nothing is blocked.
  int block_steps() const;
  /// Steps whose adjoints gradient() does in one pass, making the states between them again; 1 where nothing is
  /// blocked.
  int gradient_block_steps() const;
  const std::string& state_name(int state) const;
  /// -1 when there is no such state.
  int state_index(std::string_view name) const;
  /// The caller sets the interior; run(), loss() and gradient() fill the halo and leave the rest alone.
  Field& initial(int state);

  /// What the solves of the steps and of the losses have met, and those of their adjoints.
  std::deque<SolveNote> solve_notes() const;
  /// The first of them whose solution has no derivative that is known; null where there is none.
  const SolveNote* without_derivative(const std::function<bool(std::string_view)>& is_unknown) const;
  std::deque<SolveNote> adjoint_solve_notes() const;

  /// Sets a parameter in all programs that have it; false when none has it. Not for the inner loop: it looks up names.
  bool set_param(std::string_view name, double value);

  /// The time of state 0 from now on, in place of RolloutSetup::t0. Controls stay with the numbers of the steps.
  void set_begin(double t0);

  /// Makes the parameter a control: it is values[n / every] in step n and in losses at state n, the last value beyond.
  /// @throws Error(input) for every < 1 or no values.
  void set_control(std::string_view name, int every, std::span<const double> values);

  /// The parts of the steps that the last run(), loss() or gradient() has made, under a tolerance.
  const StepRecord& record() const;
  /// The same parts from now on, whatever their errors: `record` must stay and hold all steps that are asked for. Null:
  /// as the tolerance says. A rollout without a trial program follows another one's (RolloutSetup::follows).
  void follow(const StepRecord* record);
  /// With what the last run() ended; and what the next one that does not begin at step 0 goes on with.
  const StepController& controller() const;
  void set_controller(const StepController& controller);

  /// Takes over what the caller has changed in the weights of networks, for advance(); run(), loss(), gradient() and
  /// restart() do it anyway.
  void update_weights();

  /// Forward from initial(); keeps the last state. Looks for values that are not finite at intervals and, when there
  /// are some, runs again from the last good state to find the first. Losses are not evaluated. initial() may hold the
  /// state after `first` steps, to go on from there to the same end.
  RunResult run(const Observer& observer = {}, int first = 0);
  /// Base pointers of the states where the last run() ended, halos filled; valid until the next call.
  const std::vector<void*>& final_states() const;

  /// Stepping by hand: restart() makes a copy of initial() the present state and advance() goes on from it, beyond the
  /// setup's steps too; no losses, no look for values that are not finite. In between the caller may change the
  /// interior of present(). run(), loss() and gradient() lose the present state: restart() again. With `step` the
  /// numbers of the steps begin there, in place of 0. `until_steady`: of such setups, ends where that is reached.
  void restart(int step = 0);
  RunResult advance(int steps, bool until_steady = false);
  const std::vector<void*>& present() const;

  /// Value of the loss (forward only; nothing is stored). Not a number when stopped.
  double loss();
  /// @throws Error(run) when the adjoint of the step or of a loss is missing.
  const GradientResult& gradient();
  /// Of runs until steady: loss() and gradient() are those of the state x = S(x) that the step S leaves as it is, which
  /// Newton's method finds from where the run ends. How far they are from those of that end says how good these are.
  void end_at_rest(bool ends_at_rest);
  /// Of the last loss(): by each parameter of its losses of averages, averages among them.
  std::vector<std::pair<std::string, double>> derivatives_of_averages();
  /// Of a term that is no loss of averages, from the next loss() on.
  void set_weight(std::size_t term, double weight);
  /// Of the last loss() or gradient(); null: its last state is not far above where it began.
  const FarState* far_state() const;
  /// Whether the last loss() or gradient() was.
  bool was_stopped() const;
  /// Calls `call` every so many steps of gradient() and loss() and at their end; an empty one ends that.
  void watch_gradient(GradientCallback call, int every);
  /// Root of the sum of squares over all states and cells of the adjoint at the state that a call of watch_gradient()
  /// is at, where that is on its way back.
  double adjoint_norm() const;

  // Of the last gradient(), by name.
  /// Of a state at the start or a sought field, of a control field the first interval's; base null when it is neither.
  FieldView bar_of(std::string_view field) const;
  /// The interior of that; of a control field those of all intervals, one after the other.
  void copy_field_bar(std::string_view field, std::span<double> to) const;
  /// Of a parameter, of a control for each interval, or of the weights of a network; zeros where the loss does not
  /// depend on it.
  void copy_param_bar(std::string_view param, std::span<double> to) const;
  /// Of the rates of a network's weights.
  void copy_rate_bar(std::string_view network, std::span<double> to) const;
  /// Parameters whose gradient the adjoint programs compute.
  const std::vector<std::string>& param_bar_names() const;
  /// As in the setup.
  const std::vector<std::string>& sought() const;

 private:
  struct Impl;
  friend GradientPlan plan_gradient(RolloutSetup setup);
  std::unique_ptr<Impl> impl_;
};

}  // namespace dpde
