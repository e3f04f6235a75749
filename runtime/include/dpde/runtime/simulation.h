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
//  - loss() and gradient() start from the initial state: that of the scene, of the `from` of the task's unknowns, or of
//    set_initial(). They do not change the present state. reset() makes the initial state the present one.
//  - Formulas of initial states and coefficients are evaluated again after set(), except for values given by the host.
//    Numbers that the compiler computed from parameters (extents, cells, other parameters) do not change.
// - The vector of unknowns holds the values of unknowns(), one after the other.
//  - step(), state(), loss() and gradient() allocate no memory after their first call.
// - A Simulation is for one thread at a time; several may run in parallel. Progress callbacks may read it, not run it.
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

/// Result of an optimiser. The unknowns of the simulation then have the values it found.
struct Optimised {
  StopReason reason = StopReason::iterations;
  double loss = 0;             // at the values found
  std::vector<double> losses;  // entry k: before update k; one entry more than updates were made
  int iterations = 0, evaluations = 0, hessian_products = 0;
};

/// A compiled scene or task.
class Simulation {
 public:
  /// The scene's data and programs must outlive the object; it holds `keep` (the code of a scene compiled in memory).
  /// @throws Error(input) for cells that do not fit, Error(machine) when memory runs out.
  explicit Simulation(const dpde_scene& scene, const SimulationOptions& options = {},
                      std::shared_ptr<const void> keep = nullptr);
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  // Unknown names and arrays of wrong length throw Error(input) with the valid choices.

  /// Names of the parameters.
  std::vector<std::string> params() const;
  /// Names of the fields that steps change; of a vector u on two axes u.x and u.y.
  std::vector<std::string> states() const;
  /// Initial states, then coefficients, parameters, controls; empty without a task.
  std::vector<std::string> unknowns() const;
  /// Number of cells along each axis, x first.
  const std::vector<std::int64_t>& cells() const;
  /// Number of values of a field: the product of cells().
  std::size_t size() const;
  /// Cell centres along axis 0, 1, 2.
  std::vector<double> coordinates(int axis) const;

  /// For example "m/s": unit of a field, a component of one, a parameter, an observable, an axis or t; "" if none is
  /// declared. The text lives as long as the simulation.
  const char* unit(std::string_view name) const;

  /// Metadata of a run for dpde::Recorder (dpde/recorder.h); null for a scene that was compiled ahead of time. The
  /// compiler sets it for a scene compiled in memory.
  const std::shared_ptr<const RunDescription>& description() const;
  void describe(std::shared_ptr<const RunDescription> run);

  /// Sets a parameter; the second returns its value. @throws Error(input) for a parameter from which the compiler has
  /// computed a number, as an extent.
  void set(std::string_view param, double value);
  double param(std::string_view name) const;
  /// All weights of a network, in the order of dpde/network_abi.h. Initially random, from the network's seed.
  void set_weights(std::string_view network, Values values);
  std::vector<double> weights(std::string_view network) const;
  /// Names of the networks.
  std::vector<std::string> networks() const;
  /// Functions of a network that is declared with `host` in place of layers; needed before the first run. On first use
  /// the vector-Jacobian product is compared with finite differences of the value. @throws Error(input) for a network
  /// with layers.
  void supply(std::string_view network, HostNetwork functions);
  /// One value for each interval of time; of a control field one field each, as in set_field.
  void set_control(std::string_view name, Values values);
  std::span<const double> control(std::string_view name) const;
  /// size() values of a state, at the present time and for the start of runs, losses and gradients.
  void set_state(std::string_view name, Values values);
  void set_initial(std::string_view name, Values values);
  /// Values of a coefficient, a control field (one interval after the other) or data of the task (as many states as it
  /// has times; numbers for data of one number a time). Other formulas of the scene that contain the coefficient's own
  /// formula do not follow: an error unless they have given values too.
  void set_field(std::string_view name, Values values);
  /// The names that set_field() accepts.
  std::vector<std::string> fields() const;
  /// How many values set_field() expects, and whether they are numbers, one a time.
  std::size_t field_size(std::string_view name) const;
  bool is_number(std::string_view name) const;
  /// size() values of a state at the present time, written to `to` or returned.
  /// @throws NotFinite once if a state is no longer finite; later calls return the values as they are.
  void state(std::string_view name, Target to) const;
  std::vector<double> state(std::string_view name) const;
  /// size() values of the initial state.
  std::vector<double> initial(std::string_view name);
  /// An observable of the scene, at the present state.
  double observe(std::string_view name);
  /// size() values of an output of the scene that has a formula, at the present state. outputs(): their names.
  std::vector<double> output(std::string_view name);
  std::vector<std::string> outputs() const;
  /// All of outputs(), in that order, computed in one pass.
  std::vector<std::vector<double>> output_values();

  /// Sets the time of the initial state, for formulas too, in place of the scene's begin. Effective on reset().
  /// Controls still go by the step number.
  void begin_at(double time);
  /// The present time, the length of a step and the number of steps since reset().
  double time() const;
  double time_step() const;
  int steps_done() const;
  /// reached(): the present state with everything that the next step depends on, except the setting. go_on_from()
  /// continues bit-identically from the state of a simulation of the same scene and setting.
  /// @throws Error(input) if the number of states or values differs.
  Reached reached();
  void go_on_from(const Reached& reached);
  /// Hash of everything that steps depend on except the scene and its parameters: the begin of time, initial states,
  /// controls, given coefficients and weights. Equal inputs give equal numbers.
  std::uint64_t start_hash();
  /// Statistics of the solves of these steps, since the simulation was made.
  std::deque<SolveNote> solve_notes() const;
  /// Makes the initial state the present one.
  void reset();
  /// Makes `count` steps. False when stopped. @throws NotFinite if a state is no longer finite (checked every 64 steps,
  /// by run and by state).
  bool step(int count = 1);
  /// run_to(): to the first step that ends at `time` or later. run(): to the end of the scene; of one with `until
  /// steady`, to the steady state. @throws NoSolution if that is not reached within its steps; the present state is
  /// then the last one.
  bool run_to(double time, const ProgressCallback& progress = {}, int every = 64);
  bool run(const ProgressCallback& progress = {}, int every = 64);
  /// Warning that the last run(), run_to(), loss() or gradient() ended with states 1e8 times above their initial values
  /// and still growing, as with steps that are too large; "": no. Above 1e50 times a NotFinite is thrown.
  const std::string& growth() const;

  // Only with a task. @throws NotFinite with state, step and cell if the run blows up; also if a loss, a gradient or a
  // product is not finite though all states are.

  /// The loss, computed from the initial state.
  double loss();
  /// Returns the loss; stores its gradient with respect to each unknown.
  double gradient();
  /// From the last gradient(), valid until the next: size() values for an initial state or coefficient and for each
  /// interval of a control field, one for a parameter, one an interval for a control.
  std::span<const double> gradient_of(std::string_view unknown) const;
  /// The same for all unknowns, one after the other.
  std::span<const double> gradient_vector() const;
  /// The values with which loss() and gradient() start, for one unknown and for all.
  std::vector<double> value_of(std::string_view unknown);
  std::vector<double> unknown_values();
  /// Sets all unknowns from one vector in this order.
  void set_unknowns(Values values);

  /// Hessian of the loss at the present values of the unknowns, times a vector; NaN when stopped.
  /// @throws Error(input) if the scene was compiled without it (HostOptions::second_order, dpde build --second-order),
  /// if the scene has no Hessian, and for gauss_newton if a loss is not a sum of squares.
  std::vector<double> hessian_vector(Values direction, Curvature curvature = Curvature::full);
  void hessian_vector(Values direction, Target product, Curvature curvature = Curvature::full);

  /// Runs the task's own optimiser within its bounds, from the present values of the unknowns. iterations > 0 overrides
  /// the task's. When stopped, by `progress` or in a gradient, the unknowns stay as they were after the last update.
  Optimised optimise(const OptimiserCallback& progress = {}, int iterations = 0);

  /// Calls `progress` every so many steps of each later loss, gradient and product, those of optimise() included. If it
  /// returns false, they are NaN and optimise() ends with StopReason::observer. An empty `progress` switches this off.
  void watch_gradients(GradientCallback progress, int every = 64);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dpde
