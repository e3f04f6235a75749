// SPDX-License-Identifier: Apache-2.0
// The inside of Simulation: the scene's fields by name and two rollouts, one for stepping, one for losses and gradients
// (made when first asked for), so that neither disturbs the other.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/rollout.h"
#include "dpde/runtime/simulation.h"

namespace dpde {

/// A program run now and then on fields of these names: formulas of fields, observables, the adjoint of initial states.
struct SingleRun {
  SingleRun(const dpde_program& program, const dpde_layout& layout, int threads) : executor(program, layout, threads) {}
  Executor executor;
};

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
  int64_t states = 1;
  int32_t start = DPDE_START_SCENE;  // of a coefficient
  bool is_unknown = false;
};

struct UnknownGradient {
  std::string name;
  int32_t kind;
  int index;  // of the state; of the sought field or parameter gradient of the rollout, -1 when the loss does not depend on it
  std::vector<double> values;
};

struct Simulation::Impl {
  Impl(const dpde_scene& scene, const SimulationOptions& options, std::shared_ptr<const void> keep);

  // Preparation
  void make_layout(const SimulationOptions& options);
  void make_params();
  void make_fields();
  void make_unknowns();
  Field& field(const std::string& name);
  RolloutSetup setup() const;
  std::vector<int> steps_of(const dpde_instants& instants) const;
  void* datum_at(const dpde_datum& datum, int step);
  LossTerm loss_term(const dpde_loss& loss);
  std::vector<const dpde_program*> programs() const;

  // Names
  std::vector<double>& control_named(std::string_view name);
  void give_controls(Rollout& rollout) const;
  double& param_named(std::string_view name);
  int state_named(std::string_view name) const;
  HostField& host_field_named(std::string_view name);

  // Values
  double param_at(std::string_view name, double t) const;
  void run_single(std::unique_ptr<SingleRun>& run, const dpde_program& program, double t);
  void update_formulas();
  void update_initial();
  void require_host_fields(bool with_data) const;
  void require_finite(const Field& field, const std::string& name) const;
  double observe(std::string_view name);

  // Stepping
  void begin_stepping();
  bool advance(int count, bool look);
  void look_for_blow_up();

  // Losses
  Rollout& objective();
  void begin_objective();
  double gradient();
  void add_gradient_through_initial(const GradientResult& result);
  void add_gradient_through_coefficients(const GradientResult& result);
  void add_sums(const Executor& adjoint);

  const dpde_scene& scene;
  SimulationOptions options;
  std::shared_ptr<const void> keep;
  std::vector<int64_t> cells;
  dpde_layout layout{};
  std::size_t size = 0;
  std::map<std::string, double, std::less<>> params, scene_params;  // all that programs get; those of the scene alone
  std::map<std::string, std::vector<double>, std::less<>> controls;  // values of those of the scene's params that are controls
  std::map<std::string, std::unique_ptr<Field>, std::less<>> fields;
  std::map<std::string, HostField, std::less<>> host_fields;        // coefficients and data
  std::vector<InitialState> initial_states;
  std::vector<Field> initial;
  bool formulas_are_stale = true, has_begun = false;
  int reached = 0, looked_at = 0;  // steps
  std::unique_ptr<SingleRun> run_initial, run_initial_adjoint, run_coefficients, run_coefficient_adjoint, run_start, run_observe;
  std::optional<Rollout> stepper, losses;
  std::vector<UnknownGradient> unknowns;
};

}  // namespace dpde
