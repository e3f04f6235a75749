// SPDX-License-Identifier: Apache-2.0
// Steps a program through time, with losses at chosen steps, and computes the gradient by running its adjoint back.
//
//  - State k is the state after k steps, at the time t0 + k * dt; state 0 is initial().
//  - loss = sum over terms and their steps k of weight * (sum `loss` of the term's program at state k).
//  - The gradient is the exact adjoint of the loop; it is bit-identical for every number of checkpoint slots and
//    threads. If the adjoints of several steps are done in one pass (block_steps), states are stored only between
//    blocks.
//  - In single precision states and their adjoints are floats; sums over steps (losses, gradients of parameters and of
//    unknown fields) are accumulated in doubles.
//  - All memory is allocated in the constructor; run(), loss() and gradient() allocate nothing of the size of a field,
//    with two exceptions, each allocated once on first use: the states between substeps of a Courant number, and a
//    state far above the start of the run (far_state()).
//
// The step program swaps (u, u_next). Its adjoint reads u (if needed) and the seeds of u_next, and swaps these with the
// adjoint of u. A loss adjoint reads the seed of the loss (see LossTerm::sum), a parameter, and writes the adjoint of
// u. Sums of both are the gradient with respect to parameters. The adjoints' links (dpde/runtime/links.h), not names,
// say which field or sum is which. The rollout sets the parameter `t` (time at the start of the step, or of the loss's
// state); the caller sets all others. Adjoints that depend on a `sought` field of the caller compute its gradient; the
// rollout adds up the contributions of all steps and losses.
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
/// between calls. Its halo is filled before each program that reads it, as that program needs.
struct BoundField {
  std::string name;
  void* base = nullptr;
  std::shared_ptr<const void> keep = nullptr;  // owner of the memory, if the caller may release it earlier
};
/// A field of the caller that changes from interval to interval: at[n / every] in step n and in losses at state n, then
/// the last one. It is also listed in RolloutSetup::fields.
struct ControlField {
  std::string name;
  int every = 1;
  std::vector<void*> at;
};
struct BoundParam {
  std::string name;
  double value = 0;
};
/// The weights of a network, in its order, and their rates for tangents. They must stay valid; values may change
/// between calls.
struct BoundWeights {
  std::string network;
  const double* values = nullptr;
  const double* rates = nullptr;            // null: 0
  bool learned = false;                     // gradient() computes d loss / d weights, if the adjoints support it
  const dpde_host_network* host = nullptr;  // of a network that the host computes
};
/// An input of a loss program that is neither a state nor in RolloutSetup::fields: one pointer for all steps, or one
/// for each entry of at_steps.
struct LossData {
  std::string name;
  std::vector<void*> at;
};
struct LossTerm {
  const dpde_program* loss = nullptr;
  const dpde_program* adjoint = nullptr;  // may be null if no gradient is computed
  std::vector<int> at_steps;              // strictly increasing, 0 .. steps
  double weight = 1;
  std::vector<LossData> data;
  std::string sum;           // name of the sum that is the loss; "": the program has only one
  std::string average = {};  // not "": see dpde_loss
  bool of_averages = false;
};

/// Index of the interval of `every` steps that contains step n, or state n; at most count - 1.
inline std::size_t control_interval(std::int64_t n, int every, std::size_t count) {
  return std::min(static_cast<std::size_t>(std::max<std::int64_t>(n, 0) / every), count - 1);
}

/// A substep: its begin, relative to the begin of the step, and its length.
struct PartOfStep {
  double begin = 0, length = 0;
};
/// The substeps of steps under a tolerance, one step after the other.
struct StepRecord {
  int first = 0;  // number of the first step
  std::vector<PartOfStep> parts;
  std::vector<std::size_t> ends;  // end of each step in `parts`

  void begin(int step) {
    first = step;
    parts.clear();
    ends.clear();
  }
  bool has(int step) const { return step >= first && static_cast<std::size_t>(step - first) < ends.size(); }
  /// @throws Error(run) if that step is not recorded.
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
  /// Adjoints that may replace `adjoint`. They take adjoints of unknown fields as inputs and add to them. The one
  /// without a step is taken if steps are reversed one by one. The one with a step, which also outputs the fields that
  /// the adjoint reads in place of states, replaces `step` too, if all states fit in memory: then these fields are
  /// stored for each step.
  std::vector<dpde_adjoint_variant> adjoint_variants;
  /// nullptr if there is no such variant.
  const dpde_adjoint_variant* find_variant(bool has_step) const {
    for (const dpde_adjoint_variant& variant : adjoint_variants) {
      if ((variant.step != nullptr) == has_step) return &variant;
    }
    return nullptr;
  }
  dpde_layout layout{};
  int steps = 0;
  double t0 = 0, dt = 0;
  Team team;
  /// Not null: the layout is a subgrid. All ranks make the same calls. initial(), final_states(), adjoints of fields
  /// and data cover the subgrid; losses, adjoints of parameters and run results are equal on all ranks.
  Communicator* ranks = nullptr;
  std::shared_ptr<SolverStore> solvers;  // shared with programs that run in turns with the rollout's; empty: its own
  std::vector<BoundField> fields;
  std::vector<BoundParam> params;
  std::vector<ControlField> control_fields;
  std::vector<BoundWeights> weights;
  std::vector<std::string> sought;  // names among `fields`: gradient() computes d loss / d field for them
  std::vector<LossTerm> losses;
  /// Not null: steps limited by a Courant number. The program computes the field `rate_field`, speed over spacing
  /// summed over the axes. With r its largest value at the start of a step, that step consists of ceil(dt*r/courant)
  /// equal substeps. States, losses and controls belong to whole steps. The number of substeps is not differentiated:
  /// it is piecewise constant.
  const dpde_program* rate = nullptr;
  std::string rate_field;
  double courant = 1;
  /// Not null: steps under a tolerance. `trial` is `step` with one sum: over all cells the square of (estimated error /
  /// tolerated error). A PI controller chooses substeps for which the root mean square is at most 1; substeps above 1
  /// are repeated with a shorter length. States, losses and controls belong to whole steps. Lengths are not
  /// differentiated: gradients hold them constant.
  const dpde_program* trial = nullptr;
  int error_order = 1;    // the estimate is of order length^error_order for short substeps
  double first_part = 0;  // length of the first substep to try
  bool follows = false;   // the substeps are those of another rollout, set by follow()
  /// > 0: the run ends with the first step in which no value changes by more than this per unit of time. That state
  /// counts as state `steps` for the losses. The gradient is that of a fixed point of the step, x = S(x, p),
  /// independent of the initial state, by one linear solve with the adjoint of the step (run/forward/steady_run.h). If
  /// `steps` are not enough loss() and gradient() throw NoSolution.
  double steady = 0;
  /// With `steady`: the states that are rates of the others, computed by a tangent step. initial() of the others must
  /// be steady; that of the rates is ignored: they are the fixed point of the tangent step.
  std::vector<std::string> rates;
  /// Memory limit for the states of gradient(), working states included, and for tapes of networks in as many steps as
  /// then fit; slots > 0 overrides it. If all steps fit, states that the adjoints do not read are not stored.
  int64_t checkpoint_bytes = std::numeric_limits<int64_t>::max();
  int slots = 0;
  /// Not empty: the states of gradient() are stored in a file of this folder.
  std::string checkpoint_folder;
  /// Steps of run(), loss() and gradient() done in one pass over memory (temporal blocking); 0: as many as are faster,
  /// 1: one. States and fields of gradients are bit-identical; gradients of parameters are summed in another order.
  /// Programs that cannot be blocked, and adjoints with bounded axes, run step by step.
  int block_steps = 0;
  /// > 0: truncated gradient, which leaves out effects across more than so many steps. Adjoints of the states cut,
  /// 2*cut, ... are set to 0 before the contributions of the losses there, which continue into earlier steps. Steps are
  /// then reversed one by one.
  int cut = 0;
  /// tuning() of a rollout of the same programs, layout and threads; "": not known.
  std::string tuning;
  /// Not null: the time of loss() and gradient() is added to it.
  GradientSeconds* seconds = nullptr;
  /// Checked before each step; once true, the call returns early with `stopped`.
  const std::atomic<bool>* stop = nullptr;
};

/// Argument of an observer: called for the first state, those whose number is a multiple of `every`, and the last one.
/// `states` are base pointers, halos filled.
struct Snapshot {
  int step;
  double t;
  const std::vector<void*>& states;
  bool is_last = false;         // of a run that was not stopped
  bool is_within_step = false;  // after a substep of the step that leads to state `step`
};
struct Observer {
  int every = 0;  // 0: never
  std::function<void(const Snapshot&)> call;
  bool sees_parts = false;  // also called for the states between substeps
};

struct BlowUp {
  int step;   // number of the first state that is not finite
  double t;   // its time
  int state;  // index of the state field, and its first bad cell; on a subgrid numbered in the whole grid
  Cell cell;
  double value;
};
/// The last state of a run until steady.
struct Steady {
  bool is_reached = false;
  int step = 0;  // of the state
  double t = 0;
  double change = 0;  // largest change of a value in the last step, per unit of time
};

/// The error for a run that made all its steps, where a change above `enough` remains at `last`.
Unsolved not_steady(const Steady& last, double enough);

struct RunResult {
  std::optional<Steady> steady;  // set for runs until steady that were neither stopped nor blew up
  int64_t parts = 0;             // substeps made, with a Courant number or a tolerance
  int64_t refused = 0;           // substeps rejected by their error estimate
  int steps_done = 0;            // number of the state in final_states()
  bool stopped = false;
  std::optional<BlowUp> blow_up;  // final_states() is then the last finite state
  double seconds = 0;
};

/// The linear solve for the adjoint of a steady state.
struct SteadyAdjoint {
  Steady state;
  int products = 0;     // with the adjoint of the step
  double residual = 0;  // |x_bar - (I - S_x^T)*lambda|/|x_bar|
  double bound = 0;     // its bound at the end: the tolerance, or rounding
  int64_t bytes = 0;    // of the vectors of the solve
  double unsteady = 0;  // first-order estimate of the change of the loss from here to the fixed point
  double scale = 0;     // sum of |x_bar*x|: the scale of the loss against which `unsteady` is measured
  double unrest() const { return scale == 0 ? 0 : std::abs(unsteady) / scale; }
};

struct GradientResult {
  std::optional<SteadyAdjoint> steady;
  double loss = 0;
  bool stopped = false;               // nothing else is valid then
  std::vector<FieldView> state_bars;  // d loss / d initial(i), valid until the next call
  std::vector<FieldView> field_bars;  // d loss / d unknown field (doubles), in the order of RolloutSetup::sought; of a
                                      // control field one an interval
  std::vector<double> param_bars;     // in the order of param_bar_names()
  std::vector<std::vector<double>> control_bars;  // in that order: one an interval for controls, else empty
  int stored_states = 0;                          // checkpoints in addition to the initial state
  int64_t recomputed_steps = 0;                   // forward steps beyond the first pass
  int64_t checkpoint_bytes = 0;                   // of the states allocated for gradient(), working states included
  int64_t tape_bytes = 0;                         // of intermediate results of networks and solves, stored for adjoints
  int64_t tapes_used = 0;                         // runs of them that adjoints did not have to repeat
  double forward_seconds = 0, total_seconds = 0;
};

/// What gradient() will store, as in GradientResult, and what it will recompute.
struct GradientPlan {
  bool stores_states = false;  // false: adjoints read only the last state
  int block_steps = 1;         // steps whose adjoints are done in one pass
  int stored_states = 0;
  int64_t recomputed_steps = 0, checkpoint_bytes = 0;
  int64_t tape_bytes = 0;   // of intermediate results of networks and solves, in addition
  int64_t field_bytes = 0;  // all states, adjoints, temporaries and checkpoints in memory
  int64_t kept_fields = 0;  // fields stored in place of states, over all steps; see RolloutSetup::adjoint_variants
  std::vector<OwnedMemory> owned;  // further memory: networks, transforms, solves, repeats
  std::vector<BoundField> fields;  // those of the setup that the rollout holds, since it reads them
};
/// The plan that a rollout of `setup` would choose. Fields, parameters, weights and data need not be bound, and nothing
/// of the size of a field is allocated.
GradientPlan plan_gradient(RolloutSetup setup);

/// The last state of loss() or gradient(), if its values are `suspicious_growth` times (dpde/runtime/growth.h) above
/// the initial ones.
struct FarState {
  std::vector<double> before;  // largest magnitudes of the initial state
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

  /// The fastest variants measured for sweeps over large fields, for other rollouts of the same programs, layout and
  /// threads; results do not depend on them.
  std::string tuning() const;

  int state_count() const;
  /// Steps that run() and loss() do in one pass over memory; 1: no blocking.
  int block_steps() const;
  /// Steps whose adjoints gradient() does in one pass, recomputing the states between them; 1: no blocking.
  int gradient_block_steps() const;
  const std::string& state_name(int state) const;
  /// -1 when there is no such state.
  int state_index(std::string_view name) const;
  /// The caller sets the interior; run(), loss() and gradient() fill the halo and change nothing else.
  Field& initial(int state);

  /// Statistics of the solves of the steps and of the losses, and those of their adjoints.
  std::deque<SolveNote> solve_notes() const;
  /// The first of them whose solution has no known derivative; null if there is none.
  const SolveNote* without_derivative(const std::function<bool(std::string_view)>& is_unknown) const;
  std::deque<SolveNote> adjoint_solve_notes() const;

  /// Sets a parameter in all programs that have it; returns false if none has. Looks up names: not for inner loops.
  bool set_param(std::string_view name, double value);

  /// Sets the time of state 0, in place of RolloutSetup::t0. Controls still go by the step number.
  void set_begin(double t0);

  /// Makes the parameter a control: values[n / every] in step n and in losses at state n, then the last value.
  /// @throws Error(input) for every < 1 or no values.
  void set_control(std::string_view name, int every, std::span<const double> values);

  /// The substeps of the last run(), loss() or gradient() under a tolerance.
  const StepRecord& record() const;
  /// Uses the substeps of `record` from now on, whatever their errors. It must stay valid and contain all steps. Null:
  /// back to the tolerance. A rollout without a trial program follows another one's record (RolloutSetup::follows).
  void follow(const StepRecord* record);
  /// State of the controller at the end of the last run(); the next run() that does not begin at step 0 starts with it.
  const StepController& controller() const;
  void set_controller(const StepController& controller);

  /// Applies the caller's changes of network weights, for advance(); run(), loss(), gradient() and restart() do so
  /// themselves.
  void update_weights();

  /// Runs forward from initial() and keeps the last state. Checks at intervals for values that are not finite and, if
  /// there are some, repeats the run from the last good state to find the first. Losses are not evaluated. To resume a
  /// run, initial() holds the state after `first` steps.
  RunResult run(const Observer& observer = {}, int first = 0);
  /// Base pointers of the states at the end of the last run(), halos filled; valid until the next call.
  const std::vector<void*>& final_states() const;

  /// Single steps: restart() copies initial() to the present state and advance() continues from it, also beyond the
  /// setup's steps; no losses, no check for values that are not finite. In between the caller may change the interior
  /// of present(). run(), loss() and gradient() overwrite the present state: restart() again. `step`: number of the
  /// first step. `until_steady`: ends at a steady state (RolloutSetup::steady).
  void restart(int step = 0);
  RunResult advance(int steps, bool until_steady = false);
  const std::vector<void*>& present() const;

  /// Value of the loss (forward only; nothing is stored). NaN when stopped.
  double loss();
  /// @throws Error(run) if the adjoint of the step or of a loss is missing.
  const GradientResult& gradient();
  /// Runs until steady: loss() and gradient() then belong to the fixed point x = S(x) of the step S, which Newton's
  /// method finds from the end of the run. Their difference from those at the end of the run measures the error of the
  /// latter.
  void end_at_rest(bool ends_at_rest);
  /// For the last loss(): the derivative by each parameter of its losses of averages, averages included.
  std::vector<std::pair<std::string, double>> derivatives_of_averages();
  /// Weight of a term that is not a loss of averages, from the next loss() on.
  void set_weight(std::size_t term, double weight);
  /// For the last loss() or gradient(); null: its last state is not far above its initial one.
  const FarState* far_state() const;
  /// Whether the last loss() or gradient() was stopped.
  bool was_stopped() const;
  /// Calls `call` every so many steps of gradient() and loss() and at their end; an empty `call` switches this off.
  void watch_gradient(GradientCallback call, int every);
  /// For a call of watch_gradient() on the way back: 2-norm of the adjoint of all states at the current state.
  double adjoint_norm() const;

  // Results of the last gradient(), by name.
  /// Adjoint of an initial state or unknown field (of a control field: first interval); base null if it is neither.
  FieldView bar_of(std::string_view field) const;
  /// Copies the interior of that; of a control field all intervals, one after the other.
  void copy_field_bar(std::string_view field, std::span<double> to) const;
  /// Adjoint of a parameter, of each interval of a control, or of the weights of a network; zeros if the loss does not
  /// depend on it.
  void copy_param_bar(std::string_view param, std::span<double> to) const;
  /// Adjoints of the rates of a network's weights.
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
