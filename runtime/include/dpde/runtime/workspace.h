// SPDX-License-Identifier: Apache-2.0
// Named fields, parameters and weights on one grid, and single runs of programs on them: initial states, coefficients,
// exact solutions, observables, tests.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/memory_count.h"
#include "dpde/runtime/rollout.h"
#include "dpde/runtime/team.h"

namespace dpde {

class Workspace {
 public:
  /// A parameter with a value for each interval of time.
  struct Control {
    int every = 1;  // steps
    std::vector<double> values;
  };
  /// Of a network: its weights, their rates, and the gradients of both from the last run of an adjoint.
  struct Weights {
    std::vector<double> values, rates, bars, rate_bars;
    const dpde_host_network* host = nullptr;  // of a network that the host computes
    dpde_weights bound() { return {values.data(), rates.data(), bars.data(), rate_bars.data(), host}; }
  };
  struct Axis {
    std::string name;
    double low, spacing;
    bool is_periodic;
  };
  struct Noise {
    std::string name;
    std::uint64_t seed;
  };
  /// Contents at the start: coordinates, noise, `dt` and the other parameters.
  struct Setup {
    dpde_layout layout{};
    Team team;
    Communicator* ranks = nullptr;                 // not null: the layout is of a subgrid
    std::shared_ptr<MemoryCount> count = nullptr;  // EngineOptions::count
    double t_begin = 0, step = 1;
    std::vector<Axis> axes;
    std::vector<Noise> noises;
    std::vector<BoundParam> params;
    std::map<std::string, Control, std::less<>> controls;
  };
  template <class Value>
  using Named = std::map<std::string, Value, std::less<>>;

  /// @throws Error(machine) when memory runs out.
  explicit Workspace(Setup setup);

  const dpde_layout& layout() const { return setup_.layout; }
  /// Shared by all callers that run its programs one after the other.
  const Team& team() const { return setup_.team; }
  /// Likewise.
  const std::shared_ptr<SolverStore>& solvers() const { return solvers_; }
  std::size_t cell_count() const { return cell_count_; }
  double t_begin() const { return setup_.t_begin; }
  /// Sets the time at which intervals of controls begin.
  void begin_at(double time) { setup_.t_begin = time; }

  /// A field by name; if missing it is made: a coordinate, or zero.
  Field& field(std::string_view name);
  /// State `number` of data or of a control field; number 0 is field(name).
  Field& field(std::string_view name, std::size_t number);
  /// A field without a name.
  std::shared_ptr<Field> make_field();
  /// Frees the fields that the program computes; they are made again on demand.
  void release(const dpde_program& program);
  void release(std::string_view name);
  /// Frees the coordinates, whole fields that as a rule only formulas read; rollouts that read them hold them. Only
  /// once: a field requested again may be needed in each step, and stays.
  void release_coordinates();
  /// All existing fields, and the coordinates.
  std::vector<BoundField> bound_fields();
  /// Interior values of a field; of a control field all intervals, one after the other.
  std::vector<double> dense(std::string_view name);
  void set_dense(std::string_view name, std::span<const double> values);

  const Named<double>& params() const { return params_; }
  void set_param(std::string_view name, double value);
  const Named<Control>& controls() const { return setup_.controls; }
  /// Also sets the parameter in params() to the first value.
  const Control& set_control(std::string_view name, int every, std::span<const double> values);
  /// 0 for parameters without a value, such as seeds and directions of derivatives.
  double param_at(std::string_view name, double t) const;
  /// Adds the weights of a network; `given` null: random from the network's seed.
  void add_weights(const dpde_network& network, const double* given);
  Named<Weights>& weights() { return weights_; }
  const Named<Weights>& weights() const { return weights_; }

  /// Fields that change from interval to interval.
  const std::vector<ControlField>& control_fields() const { return control_fields_; }
  const ControlField* find_control_field(std::string_view name) const;
  void add_control_field(std::string_view name, int every, std::size_t count);
  /// Gives `name`, a rate, the same intervals as `like`, if that is a control.
  void make_like(std::string_view name, std::string_view like);
  /// Runs the program that computes the control field `name` once for each interval, with t at its middle and new
  /// noise.
  void run_for_intervals(const dpde_program& program, std::string_view name);

  /// Fields that replace those of the workspace in a run.
  using Bound = std::map<std::string_view, void*>;
  /// Runs a program once at time `t`, or at the begin, on the fields of these names; `bound` ones are taken from there,
  /// and control fields from the interval of `t`. Missing fields are made. The result has its sums, until the next run.
  const Executor& execute(const dpde_program& program, double t, const Bound& bound = {});
  const Executor& execute(const dpde_program& program) { return execute(program, t_begin()); }
  /// The same; returns the sums by name.
  std::map<std::string, double> run(const dpde_program& program, double t, const Bound& bound = {});

 private:
  void draw_noise(std::uint64_t interval);
  std::vector<Axis>::const_iterator axis_of(std::string_view name) const;
  /// A coordinate, shared by all users that hold it at the same time; null for other names.
  std::shared_ptr<Field> lent(std::string_view name);
  std::size_t interval_at(double t, int every, std::size_t count) const;

  Setup setup_;
  std::size_t cell_count_;
  std::shared_ptr<SolverStore> solvers_ = make_solver_store();
  Named<std::shared_ptr<Field>> fields_;
  Named<std::weak_ptr<Field>> lent_;  // coordinates
  bool has_released_coordinates_ = false;
  int fields_made_ = 0;
  Named<double> params_;
  Named<Weights> weights_;
  std::vector<ControlField> control_fields_;
  std::map<const dpde_program*, std::unique_ptr<Executor>> executors_;
};

}  // namespace dpde
