// SPDX-License-Identifier: Apache-2.0
// A compiled scene in a host program: parameters and fields in, steps, results out; with a task, its loss and gradient.
// The same class serves scenes compiled in the host (dpde/dpde.h) and ahead of time (dpde build).
//
//   sim.set("nu", 0.01);                       // a parameter, by its name in the model
//   sim.set_state("u", values);                // a field now; arrays as in dpde/runtime/values.h
//   sim.step(); sim.run_to(0.5); sim.run();    // one step, to a time, to the scene's end
//   sim.state("u", values);
//   double loss = sim.gradient();              // from the initial state, whatever was stepped before
//   sim.gradient_of("nu")[0];
//   sim.hessian_vector(direction);             // the Hessian times a vector of all unknowns
//   sim.optimise();                            // as the task says; then sim.value_of("nu")[0]
//
//  - loss() and gradient() start from the initial state: the scene's, or the `from` of the task's unknowns, or what
//    set_initial() gave. They leave the state reached by stepping as it is. reset() makes the initial state the present
//    one.
//  - Formulas of initial states and coefficients are evaluated again after set(), except where the host gave values.
//    Numbers that the .dpde file computed from parameters (extents, cells, other parameters) stay.
//  - The vector of unknowns holds those of unknowns() one after the other.
//  - step(), state(), loss() and gradient() allocate no memory after their first call.
//  - One thread at a time may use a Simulation; several may run at once. Progress of a run may read it, and not run it.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/curvature.h"
#include "dpde/runtime/host_network.h"
#include "dpde/runtime/progress.h"
#include "dpde/runtime/reached.h"
#include "dpde/runtime/simulation_options.h"
#include "dpde/runtime/solve_note.h"
#include "dpde/runtime/values.h"
#include "dpde/scene_abi.h"

namespace dpde {

struct RunDescription;

/// What an optimiser did. The unknowns of the simulation have the values it found.
struct Optimised {
  StopReason reason = StopReason::iterations;
  double loss = 0;             // with the values found
  std::vector<double> losses;  // entry k: before update k; one entry more than updates were made
  int iterations = 0, evaluations = 0, hessian_products = 0;
};

class Simulation {
 public:
  /// The scene's data and programs must stay; `keep` is held as long (the code of a scene compiled in memory).
  /// @throws Error(input) for cells that do not fit, Error(machine) when memory runs out.
  explicit Simulation(const dpde_scene& scene, const SimulationOptions& options = {},
                      std::shared_ptr<const void> keep = nullptr);
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  // Names that are not there and arrays of another length are an Error(input) that says what would fit.
  std::vector<std::string> params() const;
  std::vector<std::string> states() const;
  /// Initial states, then coefficients, parameters, controls; empty without a task.
  std::vector<std::string> unknowns() const;
  const std::vector<std::int64_t>& cells() const;
  std::size_t size() const;  // values of a field
  /// Cell centres along axis 0, 1, 2.
  std::vector<double> coordinates(int axis) const;

  /// "m/s": of a field, a component of one, a parameter, an observable, an axis or t; "" where none is told. A text
  /// that lives as long as the simulation.
  const char* unit(std::string_view name) const;
  /// What files say of a run beside its values, for dpde::Recorder (dpde/recorder.h); null of a scene that was compiled
  /// ahead of time. Who compiles a scene in memory tells it.
  const std::shared_ptr<const RunDescription>& description() const;
  void describe(std::shared_ptr<const RunDescription> run);

  void set(std::string_view param, double value);
  double param(std::string_view name) const;
  /// All weights of a network, in the order of dpde/network_abi.h. They begin random, as the network's seed says.
  void set_weights(std::string_view network, Values values);
  std::vector<double> weights(std::string_view network) const;
  std::vector<std::string> networks() const;
  /// What a network computes that says `host` in place of layers; to be given before anything runs. Its vector-Jacobian
  /// product is compared with differences of its value when it is used first. @throws Error(input) for a network with
  /// layers.
  void supply(std::string_view network, HostNetwork functions);
  /// One value for each interval of time; of a control field one field, as set_field does.
  void set_control(std::string_view name, Values values);
  std::span<const double> control(std::string_view name) const;
  void set_state(std::string_view name, Values values);
  void set_initial(std::string_view name, Values values);
  /// A coefficient, which other formulas of the scene that are made of its own do not follow: an error where these have
  /// no values of their own; a control field, one interval after the other; or data of the task: as many states as it
  /// has times, or numbers where the data are one number a time.
  void set_field(std::string_view name, Values values);
  /// The names that set_field() knows.
  std::vector<std::string> fields() const;
  /// How many values set_field() wants of it; whether these are numbers, one a time.
  std::size_t field_size(std::string_view name) const;
  bool is_number(std::string_view name) const;
  /// @throws NotFinite when a state is no longer finite; what is asked for after that comes as it is.
  void state(std::string_view name, Target to) const;
  std::vector<double> state(std::string_view name) const;
  std::vector<double> initial(std::string_view name);
  /// An observable of the scene, at the present state.
  double observe(std::string_view name);
  /// An output of the scene that has a formula, at the present state: size() values. outputs(): their names.
  std::vector<double> output(std::string_view name);
  std::vector<std::string> outputs() const;
  /// All of them, in that order, computed at once.
  std::vector<std::vector<double>> output_values();

  /// Time begins here in place of the scene's begin: that of the initial state, for formulas too. reset() follows.
  /// Controls stay with the numbers of the steps.
  void begin_at(double time);
  double time() const;
  double time_step() const;
  int steps_done() const;
  /// The present state with all that the next step hangs on but for the setting; and goes on from one of a simulation
  /// of the same scene and setting, to the same bits. @throws Error(input) where states or values are of another
  /// number.
  Reached reached();
  void go_on_from(const Reached& reached);
  /// The same number of simulations whose time begins at the same instant with the same initial states, controls,
  /// coefficients that are given, and weights: of all that steps hang on but for the scene and its parameters.
  std::uint64_t start_hash();
  /// What the solves of these steps have met, since the simulation was made.
  std::deque<SolveNote> solve_notes() const;
  void reset();
  /// False when stopped. @throws NotFinite when a state is no longer finite (looked at every 64 steps, by run and by
  /// state).
  bool step(int count = 1);
  /// To the first step that ends at `time` or later; to the end of the scene, of one `until steady` to where it is.
  /// @throws NoSolution where that is not reached in all its steps; the last state is the present one then.
  bool run_to(double time, const ProgressCallback& progress = {}, int every = 64);
  bool run(const ProgressCallback& progress = {}, int every = 64);
  /// Where the last run(), run_to(), loss() or gradient() has left states 1e8 times above where they began, growing on,
  /// as in steps that are too large: a sentence; else "". Beyond 1e50 times it is a NotFinite.
  const std::string& growth() const;

  // With a task only. @throws NotFinite where the run blows up: which state, after which step, in which cell; and where
  // a loss, a gradient or a product is not finite though all states are.
  double loss();
  /// The loss; its gradient with respect to each unknown is kept.
  double gradient();
  /// Of the last gradient(), valid until the next: size() values for an initial state or coefficient and for each
  /// interval of a control field, one for a parameter, one an interval for a control.
  std::span<const double> gradient_of(std::string_view unknown) const;
  /// The same of all unknowns, one after the other.
  std::span<const double> gradient_vector() const;
  /// The values that loss() and gradient() begin with, of one unknown and of all.
  std::vector<double> value_of(std::string_view unknown);
  std::vector<double> unknown_values();
  void set_unknowns(Values values);

  /// Second derivatives of the loss at the present values of the unknowns, times a vector; not a number when stopped.
  /// @throws Error(input) when the scene was compiled without them (HostOptions::second_order, dpde build
  /// --second-order), when it has none, and for gauss_newton when a loss is not a sum of squares.
  std::vector<double> hessian_vector(Values direction, Curvature curvature = Curvature::full);
  void hessian_vector(Values direction, Target product, Curvature curvature = Curvature::full);

  /// The task's own optimiser within its bounds, from the present values of the unknowns. iterations > 0 overrides the
  /// task's. Stopped, by `progress` or whatever stops gradients, it leaves the unknowns as they were after the last
  /// update.
  Optimised optimise(const OptimiserCallback& progress = {}, int iterations = 0);

  /// Calls `progress` every so many steps of each loss, gradient and product from now on, those of optimise() too. When
  /// it returns false, they are not a number and optimise() ends with StopReason::observer. An empty one ends it.
  void watch_gradients(GradientCallback progress, int every = 64);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dpde
