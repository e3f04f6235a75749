// SPDX-License-Identifier: Apache-2.0
// Implementation of Simulation: an engine, the present state, and the messages for a wrong name, length or value.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/engine.h"
#include "dpde/runtime/growth.h"
#include "dpde/runtime/simulation.h"
#include "exec/supplied_network.h"

namespace dpde {

/// While it exists, a progress callback that starts another run of the same simulation is refused.
class Running {
 public:
  explicit Running(bool& is_running) : is_running_(is_running) {
    if (is_running)
      throw Error(ErrorKind::input,
                  "the simulation is running: its progress may read it and end it, but not run or reset it");
    is_running_ = true;
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() { is_running_ = false; }

 private:
  bool& is_running_;
};

/// Result of the check for growth.
struct GrowthVerdict {
  std::vector<double> judged;  // magnitudes for which it holds; of steps 0: not far above the start
  std::string text;            // "": no growth
};

/// @throws Error(input) with the known names.
[[noreturn]] void no_such(const dpde_scene& scene, std::string_view kind, std::string_view name,
                          const std::vector<std::string>& known);

struct Simulation::Impl {
  Impl(const dpde_scene& scene, const SimulationOptions& options, std::shared_ptr<const void> keep);

  /// Returns the result of `call`; adds details to its errors.
  template <class Call>
  auto explained(const Call& call) try {
    return call();
  } catch (Error& error) {
    say_more(error);
    throw;
  }
  void say_more(Error& error) const;

  // Names
  void require_param(std::string_view name) const;
  const std::vector<double>& control_named(std::string_view name) const;
  const std::vector<double>& weights_named(std::string_view name) const;
  std::size_t state_named(std::string_view name) const;
  const Engine::Given& field_named(std::string_view name) const;
  const Engine::Unknown& unknown_named(std::string_view name) const;

  // Values
  void set_control(std::string_view name, Values values);
  void set_field(std::string_view name, Values values);
  void require_given(bool with_data);
  void require_followed(bool initial) const;
  void require_finite();
  void require_size(Values values, std::string_view what) const;
  double observe(std::string_view name);
  std::vector<std::vector<double>> output_values();
  std::uint64_t start_hash();
  std::span<const dpde_output> outputs() const;
  /// The present states by name.
  Workspace::Bound present();

  // Stepping
  void begin_stepping();
  Reached present_state();
  void go_on_from(const Reached& reached);
  std::optional<Steady> advance(int count, bool look, bool until_steady);
  bool run_to_step(int step, bool until_steady, const Simulation& host, const ProgressCallback& progress, int every);
  void look_for_blow_up();
  /// Sets `of_steps` to the states that have grown far above their start. This takes another step, so a verdict is kept
  /// until a state is as far above the judged magnitudes. @throws NotFinite if growth is beyond reason.
  void look_for_growth();
  /// Sets `of_losses` likewise from the state of the last losses; kept while that state is the same.
  void look_for_growth_of_losses();
  void measure_start(Rollout& rollout);
  std::string text_of(const Growth& growth, int steps) const;
  std::string text_of(const std::vector<Growth>& growths, int steps) const;
  double time() const { return engine.t_begin() + reached * engine.scene().step; }

  // Losses
  void begin_objective();
  double gradient();
  double gradient_or_none();
  /// Repeats the run from the initial state in `rollout`. @throws NotFinite with the first state, step and cell that
  /// blows up, else that `what` is not finite.
  [[noreturn]] void refuse(Rollout& rollout, const std::string& what);
  void product(Values direction, Target to, Curvature curvature);
  Optimised optimise(const OptimiserCallback& progress, int iterations);

  Engine engine;
  std::vector<std::string> param_names, control_names;  // of the scene; no name is in both
  Workspace::Named<std::unique_ptr<SuppliedNetwork>> supplied;
  std::vector<double> began, start;  // largest initial magnitudes of the states, for stepping and for losses
  GrowthVerdict of_steps, of_losses;
  const GrowthVerdict* told = &of_steps;  // the verdict of the last run, loss or gradient
  bool is_running = false;
  bool has_begun = false;
  int reached = 0, looked_at = 0;       // steps
  std::vector<double> gradient_values;  // of all unknowns
  std::shared_ptr<const RunDescription> run;
};

}  // namespace dpde
