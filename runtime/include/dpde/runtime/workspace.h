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
#include "dpde/runtime/rollout.h"
#include "dpde/runtime/team.h"

namespace dpde {

class Workspace {
 public:
  /// Parameters with a value for each interval of time.
  struct Control {
    int every = 1;  // steps
    std::vector<double> values;
  };
  /// Of a network: its weights, their rates, and what the last run of an adjoint added to the gradients of both.
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
  /// What is there from the start: coordinates, noise, `dt` and the rest of the parameters.
  struct Setup {
    dpde_layout layout{};
    Team team;
    Communicator* ranks = nullptr;  // not null: the layout is of a subgrid
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
  /// For all that runs its programs, one after the other.
  const Team& team() const { return setup_.team; }
  /// Likewise.
  const std::shared_ptr<SolverStore>& solvers() const { return solvers_; }
  std::size_t cell_count() const { return cell_count_; }
  double t_begin() const { return setup_.t_begin; }
  /// Intervals of controls begin here.
  void begin_at(double time) { setup_.t_begin = time; }

  /// A field by name; made when it is not there: a coordinate, or all zero.
  Field& field(std::string_view name);
  /// State `number` of data or of a control field; the first is field(name).
  Field& field(std::string_view name, std::size_t number);
  /// Gives back what the program computes; it is made again when it is asked for.
  void release(const dpde_program& program);
  void release(std::string_view name);
  /// Whole fields, which formulas alone read as a rule: rollouts that read them keep them. Once: what asks for them
  /// again makes them again, and may ask in each step.
  void release_coordinates();
  /// All that are there, and the coordinates.
  std::vector<BoundField> bound_fields();
  /// Its values; of a control field those of all intervals, one after the other.
  std::vector<double> dense(std::string_view name);
  void set_dense(std::string_view name, std::span<const double> values);

  const Named<double>& params() const { return params_; }
  void set_param(std::string_view name, double value);
  const Named<Control>& controls() const { return setup_.controls; }
  /// params() then has the first value.
  const Control& set_control(std::string_view name, int every, std::span<const double> values);
  /// 0 for what nobody has set, as seeds and directions of derivatives.
  double param_at(std::string_view name, double t) const;
  /// Values as they are given or, null, as the network's seed says.
  void add_weights(const dpde_network& network, const double* given);
  Named<Weights>& weights() { return weights_; }
  const Named<Weights>& weights() const { return weights_; }

  /// Fields that are others in each interval of time.
  const std::vector<ControlField>& control_fields() const { return control_fields_; }
  const ControlField* find_control_field(std::string_view name) const;
  void add_control_field(std::string_view name, int every, std::size_t count);
  /// Makes `name`, a rate, one with the same intervals as `like`, where that is one.
  void make_like(std::string_view name, std::string_view like);
  /// Runs the program that keeps the control field `name` once for each interval, with t in its middle and noise drawn
  /// anew.
  void run_for_intervals(const dpde_program& program, std::string_view name);

  /// Fields that a run takes from elsewhere.
  using Bound = std::map<std::string_view, void*>;
  /// Runs a program once at time `t`, or at the begin, on the fields of these names, `bound` ones taken from there
  /// instead and control fields from the interval of `t`; what the program needs beside them is made. The result has
  /// its sums, until the next run.
  const Executor& execute(const dpde_program& program, double t, const Bound& bound = {});
  const Executor& execute(const dpde_program& program) { return execute(program, t_begin()); }
  /// The same; returns the sums by name.
  std::map<std::string, double> run(const dpde_program& program, double t, const Bound& bound = {});

 private:
  void draw_noise(std::uint64_t interval);
  std::vector<Axis>::const_iterator axis_of(std::string_view name) const;
  /// A coordinate, one for all that have it at a time; null of other names.
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
