// SPDX-License-Identifier: Apache-2.0
// The inside of Simulation: the scene's fields by name and two rollouts, one for stepping, one for losses and gradients
// (made when first asked for), so that neither disturbs the other.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/optimise.h"
#include "dpde/runtime/rollout.h"
#include "dpde/runtime/simulation.h"
#include "supplied_network.h"

namespace dpde {

/// An initial state and who gives it.
struct InitialState {
  std::string name;
  int32_t start = DPDE_START_SCENE;  // DPDE_START_HOST: nobody but the host
  bool is_unknown = false;
  bool is_given = false;  // by the host
};

/// Values that the host has to give, and whether it has.
struct HostField {
  bool is_given = false, is_needed = false;
  int64_t states = 1;                // of data; of a control field one an interval
  int32_t every = 0;                 // of a control field
  int32_t start = DPDE_START_SCENE;  // of a coefficient
  bool is_unknown = false;
};

/// An unknown and its part of the vector of all of them.
struct Unknown {
  std::string name, rate;  // the rate as tangents call it; "" where none varies by it
  int32_t kind;
  double low, high;
  std::size_t offset, size;
  bool is_network() const { return kind == DPDE_UNKNOWN_NETWORK; }
  bool is_field() const { return kind == DPDE_UNKNOWN_INITIAL || kind == DPDE_UNKNOWN_COEFFICIENT; }
  template <class Number>
  std::span<Number> part_of(std::span<Number> all) const {
    return all.subspan(offset, size);
  }
};

struct Simulation::Impl {
  Impl(const dpde_scene& scene, const SimulationOptions& options, std::shared_ptr<const void> keep);

  // Preparation
  void make_layout(const SimulationOptions& options);
  void make_params();
  void make_fields();
  std::string_view rate_of(int32_t kind, std::string_view name) const;
  std::string_view rate_of(const dpde_unknown& unknown) const;
  void make_unknowns();
  Field& field(std::string_view name);
  /// Of data at several times, and of control fields: the first is field(name).
  Field& state_of(std::string_view name, int64_t number);
  void make_control_field(std::string_view name, int32_t every, int32_t count);
  void draw_noise(std::uint64_t interval);
  RolloutSetup setup() const;
  std::vector<int> steps_of(const dpde_instants& instants) const;
  void* datum_at(const dpde_datum& datum, int step);
  LossTerm loss_term(const dpde_loss& loss, const dpde_program& program);
  std::vector<const dpde_program*> programs() const;

  // Names
  std::vector<double>& control_named(std::string_view name);
  std::vector<double>& weights_named(std::string_view name);
  void set_weights(std::string_view network, Values values);
  /// Null where the network has layers.
  const dpde_host_network* host_of(std::string_view network) const;
  void give_controls(Rollout& rollout) const;
  double& param_named(std::string_view name);
  int state_named(std::string_view name) const;
  HostField& host_field_named(std::string_view name);

  // Values
  double param_at(std::string_view name, double t) const;
  std::size_t interval_at(double t, int every, std::size_t count) const;
  void* field_at(std::string_view name, double t);
  void copy_in_all(std::string_view name, Values values);
  void copy_out_all(std::string_view name, Target to);
  void set_param(std::string_view name, double value);
  void begin_at(double time);
  void set_control(std::string_view name, Values values);
  /// Runs a program once on the fields of these names: formulas of fields, observables, their adjoints.
  const Executor& execute(const dpde_program& program, double t);
  const Executor& execute(const dpde_program& program) { return execute(program, t_begin); }
  template <class Run>
  void keeping_given(const Run& run);
  void update_control_fields();
  void update_formulas();
  void update_initial();
  bool needs_initial() const;
  void require_host_fields(bool with_data) const;
  void require_finite(const Field& field, const std::string& name) const;
  double observe(std::string_view name);

  // Stepping
  void begin_stepping();
  bool advance(int count, bool look);
  bool run_to_step(int step, const Simulation& host, const ProgressCallback& progress, int every);
  void look_for_blow_up();

  // Losses
  Rollout& objective();
  void begin_objective(Rollout& rollout);
  double gradient();
  /// Runs again from the initial state that `rollout` has. @throws NotFinite that says where a state blows up first,
  /// else that `what` is not finite.
  [[noreturn]] void refuse(Rollout& rollout, const std::string& what) const;
  bool comes_from_formula(std::string_view field) const;
  std::string_view value_of_rate(std::string_view rate) const;
  void copy_bars(const Rollout& rollout, bool of_rates, std::span<double> to) const;
  void add_through_formulas(const Rollout& rollout, bool of_rates, const dpde_program* initial,
                            const dpde_program* coefficients, std::span<double> to);

  // The unknowns as one vector
  const Unknown& unknown_named(std::string_view name) const;
  void require_size(Values values, std::string_view what) const;
  void values_of(const Unknown& unknown, std::span<double> to);
  void set_unknowns(Values x);
  Optimised optimise(const OptimiserCallback& progress, int iterations);
  Bounds bounds() const;

  // Products of second derivatives
  Rollout& second_order(Curvature curvature);
  RolloutSetup second_setup(Curvature curvature);
  void set_direction(Rollout& rollout, Values direction);
  void product(Values direction, Target to, Curvature curvature);

  const dpde_scene& scene;
  SimulationOptions options;
  Team team;
  std::shared_ptr<const void> keep;
  std::vector<int64_t> cells;
  dpde_layout layout{};
  std::size_t size = 0;
  std::map<std::string, double, std::less<>> params, scene_params;  // all that programs get; those of the scene alone
  std::map<std::string, std::vector<double>, std::less<>>
      controls;  // values of those of the scene's params that are controls
  std::map<std::string, std::vector<double>, std::less<>> weights;  // of networks
  std::map<std::string, std::vector<double>, std::less<>>
      formula_bars;  // what the last execute() added to their gradients
  std::map<std::string, std::unique_ptr<SuppliedNetwork>, std::less<>> supplied;  // those that the host computes
  std::map<std::string, std::unique_ptr<Field>, std::less<>> fields;
  std::map<std::string, HostField, std::less<>> host_fields;  // coefficients and data
  std::vector<ControlField> control_fields;                   // coefficients, and their rates
  std::vector<InitialState> initial_states;
  std::vector<Field> initial;
  bool formulas_are_stale = true, has_begun = false;
  double t_begin = scene.t_begin;
  int reached = 0, looked_at = 0;                              // steps
  std::map<const dpde_program*, Executor> executors;           // of execute()
  std::optional<Rollout> stepper, losses, full, gauss_newton;  // the last two are for products
  std::vector<Unknown> unknowns;
  std::vector<double> gradient_values;  // of all unknowns
  GradientCallback watch;
  int watch_every = 1;
  bool was_stopped = false;  // the last gradient or product
};

/// What `run` computes, but for the coefficients and data that the host has given, which stay.
template <class Run>
void Simulation::Impl::keeping_given(const Run& run) {
  std::map<std::string, std::vector<double>> kept;
  for (const auto& [name, host] : host_fields) {
    if (!host.is_given || host.states != 1) continue;
    kept[name].resize(size);
    field(name).copy_out(kept[name]);
  }
  run();
  for (const auto& [name, values] : kept) field(name).copy_in(values);
}

}  // namespace dpde
