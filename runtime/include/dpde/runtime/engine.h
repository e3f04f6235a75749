// SPDX-License-Identifier: Apache-2.0
// Runs a compiled scene and its task: fields and numbers by name, the initial state by formula or as given values, the
// rollouts of steps, losses and derivatives, and the unknowns of the task as one vector. Host simulations, commands and
// training are front ends of it: they load the scene and word the error messages.
//
//  - The rollout that is opened first holds the initial state; others get copies of it.
//  - Formulas of initial states and coefficients are evaluated again after a value that they read has changed, except
//    for fields with given values (`is_given`). The formula of an unknown field defines its first guess only: it is
//    evaluated with the first guesses of the other unknowns, and derivatives by another unknown leave the field
//    constant.
//  - The vector of unknowns holds the values of unknowns(), one after the other.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/curvature.h"
#include "dpde/runtime/optimise.h"
#include "dpde/runtime/rollout.h"
#include "dpde/runtime/simulation_options.h"
#include "dpde/runtime/unsolved.h"
#include "dpde/runtime/values.h"
#include "dpde/runtime/workspace.h"
#include "dpde/scene_abi.h"

namespace dpde {

struct EngineOptions : SimulationOptions {
  std::string checkpoint_folder;  // see RolloutSetup
  /// Halo cells that the caller's own programs on the same fields need.
  std::array<std::int64_t, 3> halo{};
  /// Not null: one of several engines, each with a subgrid. `cells` are those of the whole grid; fields, unknown ones
  /// too, cover the subgrid. All engines make the same calls.
  Communicator* ranks = nullptr;
  /// Gradients skip the test for jumps in the run (dpde_scene::watched); for checks with artificial states.
  bool trusts_signs = false;
  /// Not null: the engine only counts its memory there. It has no rollouts: plan_gradient() counts those of its setups.
  std::shared_ptr<MemoryCount> count = nullptr;
  /// Returns the stored tuning of a rollout (RolloutSetup::tuning); may be empty.
  std::function<std::string(const RolloutSetup&)> find_tuning;
};

class Engine {
 public:
  struct State {
    std::string name;
    int32_t start = DPDE_START_SCENE;  // DPDE_START_HOST: only the host can give its values
    bool is_unknown = false, is_given = false;
    bool is_held = false;  // an unknown whose formula was evaluated with the first guesses of the unknowns
    bool is_kept() const { return is_given || is_held; }
  };
  /// A coefficient, or data of the task.
  struct Given {
    bool is_datum = false, is_given = false;
    bool is_needed = false;            // it has no formula: values must be given
    std::size_t states = 1;            // of data; of a control field: one an interval
    int32_t start = DPDE_START_SCENE;  // of a coefficient
    bool is_unknown = false, is_held = false;
    bool is_number = false;  // data: one number a state, the same in all cells
    bool is_kept() const { return is_given || is_held; }
  };
  /// An unknown and its part of the vector of all unknowns.
  struct Unknown {
    std::string name, rate;  // rate: the name of its tangent; "" if nothing depends on it
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

  /// The scene's data and programs must outlive the engine; it holds `keep` for that.
  /// @throws Error(input) for cells that do not fit, Error(machine) when memory runs out.
  Engine(const dpde_scene& scene, EngineOptions options, std::shared_ptr<const void> keep);
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  const dpde_scene& scene() const { return scene_; }
  const EngineOptions& options() const { return options_; }
  Workspace& workspace() { return *workspace_; }
  const Workspace& workspace() const { return *workspace_; }
  const std::vector<std::int64_t>& cells() const { return cells_; }
  /// In the order of the rollouts.
  const std::vector<State>& states() const { return states_; }
  const Workspace::Named<Given>& given() const { return given_; }
  /// -1 when there is none of that name.
  int state_index(std::string_view name) const;

  // Values. The names must exist in the scene and the lengths must fit.
  void set_param(std::string_view name, double value);
  void set_control(std::string_view name, Values values);
  void set_weights(std::string_view network, Values values);
  void set_host(std::string_view network, const dpde_host_network* functions);
  void set_initial(std::size_t state, Values values);
  /// A coefficient, a control field (one interval after the other) or data (one state after the other).
  void set_field(std::string_view name, Values values);
  /// The same after the caller has written the values into the workspace. `at`: the states that the data hold, in place
  /// of those in the scene's table; empty: one state for all times.
  void take_datum(std::string_view name, std::vector<int> at);
  /// Sets the time of the initial state, for formulas too; controls still go by the step number.
  void begin_at(double time);
  double t_begin() const { return workspace_->t_begin(); }
  /// Evaluates outdated formulas: initial(state) and all fields of formulas then fit the present values.
  void update_formulas();
  Field& initial(std::size_t state) { return primary().initial(static_cast<int>(state)); }

  // Rollouts
  /// The scene's step with all fields and parameters bound, without adjoint and losses.
  RolloutSetup setup();
  /// The same with the task's losses and adjoints. @throws Error(input) for a loss at a time that its data lack.
  RolloutSetup objective_setup();
  /// The same for the run that looks for jumps before a gradient. The scene must have a step for it.
  RolloutSetup watched_setup();
  /// The rollout without losses; made on first use.
  Rollout& stepper();
  /// The rollout with the task's losses and adjoints.
  Rollout& objective();
  bool is_open() const { return primary_ != nullptr; }
  /// The rollout that holds the initial state.
  Rollout& primary() { return primary_ != nullptr ? *primary_ : scene_.task != nullptr ? objective() : stepper(); }
  /// Copies the initial state, as formulas give it now, to a rollout of this engine.
  void begin(Rollout& rollout);
  /// The same for a rollout that the caller has made from setup(); sets its parameters and controls too, but not its
  /// dt.
  void begin_other(Rollout& rollout);
  void watch_gradients(GradientCallback watch, int every);

  // Unknowns
  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  std::size_t unknown_count() const { return unknown_count_; }
  void values_of(const Unknown& unknown, std::span<double> to);
  void set_unknowns(Values x);
  /// From the task: infinite for an unknown without bounds; empty if none has any.
  Bounds bounds() const;
  double loss();
  /// Sets `to` (unknown_count() values) and returns the loss; NaN when stopped. @throws NoSolution if a divisor or a
  /// switch that the derivatives assume to be constant (dpde_scene::watched) changes in the run.
  double gradient(std::span<double> to);
  /// The first of dpde_scene::watched that jumps in the run; empty if none does.
  std::optional<Unsolved> jump_in_run();
  /// See Rollout::end_at_rest.
  void end_at_rest(bool ends_at_rest);
  const GradientResult& last_gradient() const { return *last_gradient_; }
  bool was_stopped() const { return was_stopped_; }
  /// Why there are no Hessian products; "" if there are.
  std::string why_no_products(Curvature curvature) const;
  /// Hessian of the loss times a vector, forward over reverse: the tangent of the step carries states and rates
  /// forward, the adjoint of that tangent runs back. NaN when stopped.
  void product(Values direction, std::span<double> to, Curvature curvature);
  /// Directional derivative of the loss, by tangents alone.
  double rate_along(Values direction);
  Rollout& products(Curvature curvature);
  /// With a tolerance: true fixes the substeps to those of the last loss() or gradient(), for losses and derivatives
  /// alike; false lets each choose its own.
  void hold_steps(bool hold);
  /// Frees the memory of Hessian products and tangents; they are made again on demand.
  void release_products();

 private:
  struct Datum {
    std::string name;
    std::vector<int> at;  // empty: one state for all times
  };
  void make_workspace();
  void make_fields();
  void make_unknowns();
  std::vector<const dpde_program*> programs() const;
  std::vector<const dpde_program*> formula_programs() const;
  std::vector<int> steps_of(const dpde_instants& instants) const;
  LossTerm loss_term(const dpde_loss& loss, const dpde_program& program);
  Rollout& open(std::optional<Rollout>& rollout, RolloutSetup setup);
  void begin_tangent(Rollout& rollout);
  template <class Visit>
  void for_each_rollout(const Visit& visit) {
    for (std::optional<Rollout>* rollout : {&stepper_, &losses_, &full_, &gauss_newton_, &tangent_, &watched_}) {
      if (*rollout) visit(**rollout);
    }
  }
  void give_controls(Rollout& rollout) const;
  void before_change(std::string_view name, bool (*reads)(const dpde_program&, std::string_view));
  void hold_sought(bool holds);
  /// @throws Unsolved for a solve whose solution has no derivative with respect to an unknown.
  void refuse_without_derivative(const Rollout& rollout) const;
  void add_sought_numbers(std::vector<double>& to) const;
  void put_sought_numbers(Values numbers);
  void run_all_formulas();
  bool formulas_need(const dpde_program& program, int32_t start) const;
  void run_formulas(const dpde_program& program, int32_t start);
  void* unused(std::size_t number);

  int last_loss() const;
  bool starts_by_unknowns(const dpde_program& program) const;
  void keep_watched(int step, double t, const Rollout& rollout, const std::vector<void*>& states);
  Rollout& watched_run();
  std::optional<Unsolved> jump_at_rest();
  std::string_view rate_of(int32_t kind, std::string_view name) const;
  std::string_view value_of_rate(std::string_view rate) const;
  bool comes_from_formula(std::string_view field) const;
  void copy_bars(const Rollout& rollout, bool of_rates, std::span<double> to) const;
  void add_through_formulas(const Rollout& rollout, bool of_rates, const dpde_program* initial,
                            const dpde_program* coefficients, std::span<double> to);
  RolloutSetup tangent_setup();
  void follow_objective(Rollout& rollout);
  void set_direction(Rollout& rollout, Values direction);
  void run_tangents_of_formulas();
  double weigh_averages(Values direction);
  const Unknown* find_unknown(int32_t kind, std::string_view name) const;

  const dpde_scene& scene_;
  EngineOptions options_;
  std::shared_ptr<const void> keep_;
  std::vector<const dpde_program*> formulas_;  // programs that compute fields from numbers, before the first step
  std::vector<std::int64_t> cells_;
  std::optional<Workspace> workspace_;
  std::vector<State> states_;
  Workspace::Named<Given> given_;
  std::vector<Datum> data_;
  std::vector<Unknown> unknowns_;
  std::size_t unknown_count_ = 0;
  bool formulas_are_stale_ = true, held_are_stale_ = false;
  std::vector<double> first_numbers_;  // first guesses of the unknowns that are not fields, once a field is held
  std::vector<std::shared_ptr<Field>> unused_;  // targets for formulas of fields with given values
  std::optional<Rollout> stepper_, losses_, full_, gauss_newton_, tangent_, watched_;
  StepRecord held_;
  struct Averaged {
    std::size_t term;
    std::string average;
    double weight;
  };
  std::vector<Averaged> averaged_;  // terms of tangent_ with weights = d loss / d average
  Rollout* primary_ = nullptr;
  GradientCallback watch_;
  int watch_every_ = 1;
  const GradientResult* last_gradient_ = nullptr;
  bool was_stopped_ = false;
};

}  // namespace dpde
