// SPDX-License-Identifier: Apache-2.0
// Named fields and parameters of a scene on its grid (or on another one of the same shape), and single runs of
// programs on them: initial states, coefficients, exact solutions, observables, tests.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "codegen/compiled_module.h"
#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/rollout.h"
#include "dpde/runtime/team.h"
#include "model/model.h"

namespace dpde::driver {

class Workspace {
 public:
  /// `cells`: one number an axis, in place of the scene's; empty: the scene's. The layout's halo fits every program of
  /// `code`. Coordinates x, y, z are there from the start.
  /// @throws Error(machine) when memory runs out.
  Workspace(const model::Problem& problem, const codegen::CompiledModule& code, const std::vector<int>& cells,
            int threads);

  const dpde_layout& layout() const { return layout_; }
  /// The grid's axes, `cells` applied.
  const std::vector<model::Axis>& axes() const { return axes_; }
  /// For all that runs its programs, one after the other.
  const Team& team() const { return team_; }
  std::size_t cell_count() const { return cell_count_; }
  /// Shape of arrays in files: (nz, ny, nx) without the axes that are not there.
  std::vector<std::int64_t> shape() const;
  /// "3, 4" for a cell and "x = 0.1, y = 0.2" for its centre.
  std::string cell_text(const Cell& cell) const;
  std::string place_text(const Cell& cell) const;

  /// A field by name; made (all zero) when it is not there.
  Field& field(const std::string& name);
  /// Gives back what the program computes; it is made again when it is asked for.
  void release(const dpde_program& program);
  /// Fields made so far.
  std::vector<std::string> field_names() const;
  /// Its values; of a control field those of all intervals, one after the other.
  std::vector<double> dense(const std::string& name);
  void set_dense(const std::string& name, std::span<const double> values);
  double param_at(const std::string& name, double t) const;

  const std::map<std::string, double>& params() const { return params_; }
  void set_param(const std::string& name, double value) { params_[name] = value; }

  /// Parameters with a value for each interval of time; params() then has the first one.
  struct Control {
    int every = 1;  // steps
    std::vector<double> values;
  };
  const std::map<std::string, Control>& controls() const { return controls_; }
  void set_control(const std::string& name, int every, std::vector<double> values);

  /// Of a network: its weights, which begin as the file says, their rates and what the last run added to their
  /// gradient.
  struct Weights {
    std::vector<double> values, rates, bars;
    dpde_weights bound() { return {values.data(), rates.data(), bars.data()}; }
  };
  std::map<std::string, Weights>& weights() { return weights_; }

  /// Fields that are others in each interval of time. The first of `at` is field(name).
  const std::vector<ControlField>& control_fields() const { return control_fields_; }
  /// Makes `name`, a rate, one with the same intervals as `like`, where that is one.
  void make_like(const std::string& name, const std::string& like);
  /// Runs the program that keeps the control field `name` once for each interval, with t in its middle and noise drawn
  /// anew.
  void run_for_intervals(const dpde_program& program, const std::string& name);

  /// Runs a program once at time `t`, or at the begin, on the fields of these names, `bound` ones taken from there
  /// instead and control fields from the interval of `t`; what the program needs beside them is made. The result has
  /// its sums, until the next run.
  const Executor& execute(const dpde_program& program, double t, const std::map<std::string, void*>& bound = {});
  const Executor& execute(const dpde_program& program) { return execute(program, t_begin_); }
  /// The same; returns the sums by name.
  std::map<std::string, double> run(const dpde_program& program, double t,
                                    const std::map<std::string, void*>& bound = {});

 private:
  void add_control_field(const std::string& name, int every, int count);
  void draw_noise(std::uint64_t interval);
  const ControlField* find_control_field(const std::string& name) const;
  Field& interval_of(const std::string& name, std::size_t interval);
  std::size_t interval_at(double t, int every, std::size_t count) const;

  std::vector<model::Axis> axes_;
  dpde_layout layout_;
  Team team_;
  std::size_t cell_count_;
  std::map<std::string, std::unique_ptr<Field>> fields_;
  std::map<std::string, double> params_;
  std::map<std::string, Control> controls_;
  std::map<std::string, Weights> weights_;
  std::vector<ControlField> control_fields_;
  std::vector<std::uint64_t> noises_;
  double t_begin_, step_;
  std::map<const dpde_program*, std::unique_ptr<Executor>> executors_;
};

}  // namespace dpde::driver
