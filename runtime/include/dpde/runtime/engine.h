// SPDX-License-Identifier: Apache-2.0
// Runs a compiled scene and its task: fields and numbers by name, the initial state by formulas or as it is given, the
// rollouts of steps, losses and derivatives, and the task's unknowns as one vector. Simulations of hosts, commands and
// training are faces of it: they load what it runs and say in their words what went wrong.
//
//  - The initial state lies in the rollout that is opened first; others get copies of it.
//  - Formulas of initial states and coefficients are evaluated again after a value that they read has changed, except
//    where values were given (`is_given`). Those of fields that are sought say where these begin: they take unknowns as
//    these were at first, and in derivatives by an unknown the fields stay as they are.
//  - The vector of unknowns holds those of unknowns() one after the other.
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
  /// Cells of halo that programs beside the scene's need, which the caller runs on the same fields.
  std::array<std::int64_t, 3> halo{};
  /// Not null: one of several engines that have a subgrid each. `cells` are those of the whole grid; fields, unknown
  /// ones too, are those of the subgrid. All make the same calls.
  Communicator* ranks = nullptr;
  /// Gradients do not look whether something jumps in the run (dpde_scene::watched), as of states that are made up.
  bool trusts_signs = false;
  /// What is known of the tuning of a rollout (RolloutSetup::tuning); may be empty.
  std::function<std::string(const RolloutSetup&)> find_tuning;
};

class Engine {
 public:
  struct State {
    std::string name;
    int32_t start = DPDE_START_SCENE;  // DPDE_START_HOST: nobody but who gives it knows it
    bool is_unknown = false, is_given = false;
    bool is_held = false;  // sought, and where its formula has it for unknowns as they were at first
    bool is_kept() const { return is_given || is_held; }
  };
  /// A coefficient, or data of the task.
  struct Given {
    bool is_datum = false, is_given = false;
    bool is_needed = false;            // it has no formula
    std::size_t states = 1;            // of data; of a control field one an interval
    int32_t start = DPDE_START_SCENE;  // of a coefficient
    bool is_unknown = false, is_held = false;
    bool is_number = false;  // data: one a state, the same in all cells
    bool is_kept() const { return is_given || is_held; }
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

  /// The scene's data and programs must stay; `keep` is held as long.
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

  // Values. Names are those of the scene, lengths fit.
  void set_param(std::string_view name, double value);
  void set_control(std::string_view name, Values values);
  void set_weights(std::string_view network, Values values);
  void set_host(std::string_view network, const dpde_host_network* functions);
  void set_initial(std::size_t state, Values values);
  /// A coefficient, a control field (one interval after the other) or data (one state after the other).
  void set_field(std::string_view name, Values values);
  /// The same where the caller has put the values into the workspace. `at`: data hold these states, and not those that
  /// the scene's table says; empty: one for all times.
  void take_datum(std::string_view name, std::vector<int> at);
  /// The time of the initial state, for formulas too; controls stay with the numbers of the steps.
  void begin_at(double time);
  double t_begin() const { return workspace_->t_begin(); }
  /// After it initial(state) and all fields of formulas are those of the present values.
  void update_formulas();
  Field& initial(std::size_t state) { return primary().initial(static_cast<int>(state)); }

  // Rollouts
  /// The scene's step with all fields and parameters bound, and neither adjoint nor losses.
  RolloutSetup setup();
  /// Without losses; made when it is first asked for.
  Rollout& stepper();
  /// With the task's losses and adjoints. @throws Error(input) for a loss at a time that its data do not hold.
  Rollout& objective();
  bool is_open() const { return primary_ != nullptr; }
  /// The one that holds the initial state.
  Rollout& primary() { return primary_ != nullptr ? *primary_ : scene_.task != nullptr ? objective() : stepper(); }
  /// Puts the initial state, as formulas give it now, into a rollout of this engine.
  void begin(Rollout& rollout);
  /// The same for one that the caller has made by setup(): parameters and controls, too. Its dt stays its own.
  void begin_other(Rollout& rollout);
  void watch_gradients(GradientCallback watch, int every);

  // Unknowns
  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  std::size_t unknown_count() const { return unknown_count_; }
  void values_of(const Unknown& unknown, std::span<double> to);
  void set_unknowns(Values x);
  /// As tasks say it: infinite where an unknown has none; empty when none has any.
  Bounds bounds() const;
  double loss();
  /// `to` has unknown_count() values. Not a number when stopped. @throws NoSolution where a divisor or a switch that
  /// the derivatives take for granted (dpde_scene::watched) changes in the run.
  double gradient(std::span<double> to);
  /// The first of dpde_scene::watched that jumps in the run, where one does.
  std::optional<Unsolved> jump_in_run();
  /// See Rollout::end_at_rest.
  void end_at_rest(bool ends_at_rest);
  const GradientResult& last_gradient() const { return *last_gradient_; }
  bool was_stopped() const { return was_stopped_; }
  /// "", or why there are no products.
  std::string why_no_products(Curvature curvature) const;
  /// Second derivatives of the loss times a vector: a run that carries states and rates forward through the tangent of
  /// the step, and the adjoint of that tangent back. Not a number when stopped.
  void product(Values direction, std::span<double> to, Curvature curvature);
  /// The rate of the loss along a direction, by tangents alone.
  double rate_along(Values direction);
  Rollout& products(Curvature curvature);
  /// Under a tolerance: losses and derivatives of the steps that the last loss() or gradient() has made, until that is
  /// over. Without, each makes its own.
  void hold_steps(bool hold);
  /// Gives back the memory of products and rates; they are made anew when they are asked for.
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
  /// @throws Unsolved of a solve whose solution has no derivative by an unknown.
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
  std::vector<const dpde_program*> formulas_;  // programs that turn numbers into fields, before the first step
  std::vector<std::int64_t> cells_;
  std::optional<Workspace> workspace_;
  std::vector<State> states_;
  Workspace::Named<Given> given_;
  std::vector<Datum> data_;
  std::vector<Unknown> unknowns_;
  std::size_t unknown_count_ = 0;
  bool formulas_are_stale_ = true, held_are_stale_ = false;
  std::vector<double> first_numbers_;           // of the unknowns that are no fields, once others are held
  std::vector<std::unique_ptr<Field>> unused_;  // where formulas put what is given
  std::optional<Rollout> stepper_, losses_, full_, gauss_newton_, tangent_, watched_;
  StepRecord held_;
  struct Averaged {
    std::size_t term;
    std::string average;
    double weight;
  };
  std::vector<Averaged> averaged_;  // terms of tangent_ whose weights are those that averages have in the loss
  Rollout* primary_ = nullptr;
  GradientCallback watch_;
  int watch_every_ = 1;
  const GradientResult* last_gradient_ = nullptr;
  bool was_stopped_ = false;
};

}  // namespace dpde
