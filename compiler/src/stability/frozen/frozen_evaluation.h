// SPDX-License-Identifier: Apache-2.0
// One execution of a step's tangent at a frozen point, with linear forms of perturbations in place of numbers.
#pragma once

#include <array>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "stability/frozen/frozen_kernels.h"
#include "stability/step/linear_step.h"

namespace dpde::stability {

inline constexpr double unknown_value = std::numeric_limits<double>::quiet_NaN();

/// The value at the point, its slope per cell, and its perturbation as a linear form.
struct Value {
  double number = 0;
  LinearForm form = {};
  std::array<double, 3> slope = {};  // of fields; 0 for expressions
  /// Slopes per cell of the form's coefficients, for fields that transforms read.
  std::array<LinearForm, 3> slopes_of_form = {};
};

/// Parameters and counters during a step from the point.
class NumbersOfStep {
 public:
  using Id = FrozenKernels::Id;
  NumbersOfStep(const FrozenKernels& kernels, const FrozenPoint& point, double dt);

  const FrozenPoint& point() const { return point_; }
  double parameter(Id param) const;
  double parameter(const std::string& name) const;
  void count(const std::string& counter, double number);
  void forget(const std::string& counter) { counters_.erase(counter); }
  double spacing(std::size_t axis) const { return spacing_[axis]; }
  double step() const { return dt_; }
  /// Sets dt and returns its former value.
  double set_step(double dt) { return std::exchange(dt_, dt); }

 private:
  const FrozenKernels& kernels_;
  const FrozenPoint& point_;
  double dt_;
  Id dt_param_;                 // -1: dt is not read
  std::vector<double> params_;  // all except dt
  std::array<double, 3> spacing_{};
  std::map<std::string, double> counters_;
};

class Evaluation {
 public:
  /// `varied` and `rates` as in FrozenKernels.
  Evaluation(const FrozenKernels& kernels, const std::set<std::string>& varied, const std::set<std::string>& rates,
             const FrozenPoint& point, double dt, FrozenStages& stages, bool of_constraints);

  void perturb(const std::string& field, int component) { set(field, {0, LinearForm(component)}); }
  void run(const std::vector<stencil::Statement>& body);
  const Value& at(const std::string& field) { return field_value(field); }
  bool is_too_far() const { return is_too_far_; }
  double displacement() const { return displacement_; }
  std::vector<WaveSum> take_waves() { return std::move(waves_); }

 private:
  using Id = FrozenKernels::Id;
  const Value& field_value(Id field);
  const Value& field_value(const std::string& name) { return field_value(kernels_.field(name)); }
  void set(Id field, Value value);
  void set(const std::string& name, Value value) { set(kernels_.field(name), std::move(value)); }
  double coordinate(int axis, const stencil::Offset& offset) const;
  double number_at(Id field, const stencil::Offset& offset);
  /// Calls `tell` with the offset and weight of each cell that the interpolation reads, unless it is too far.
  template <class Tell>
  void for_each_tap(const FrozenKernels::Interp& interp, const Tell& tell);
  Value value(Id node) { return {number(node), form(node)}; }
  /// The perturbation of a node.
  LinearForm form(Id node);
  /// Adds factor * form(node) to `sum_`.
  void add_form(Id node, double factor);
  void add_form_of(Id field, const stencil::Offset& offset, double factor);
  void add_form_of_binary(const FrozenKernels::Binary& b, double factor);
  void add_form_of_select(const FrozenKernels::Select& s, double factor);
  /// The unperturbed value.
  double number(Id node);
  double number_of_interp(const FrozenKernels::Interp& interp);
  double number_of_binary(const FrozenKernels::Binary& b);
  double number_of_select(const FrozenKernels::Select& s);
  double call(const FrozenKernels::Call& c);
  struct Condition {
    double truth = 0;  // 1, 0, or not known
    bool is_tie = false;
  };
  Condition compared(Id node);
  std::vector<Value> stored_values(const FrozenKernels::Kernel& kernel);
  std::optional<std::vector<FrozenValue>> frozen_values(const FrozenKernels::Kernel& kernel);
  std::optional<std::vector<Value>> values_of_states(const FrozenKernels::Kernel& kernel);
  void add_slopes_of_forms(const FrozenKernels::Kernel& kernel, std::vector<Value>& values);
  void run_kernel(const FrozenKernels::Kernel& kernel);
  void reduce(const stencil::Reduce& reduce);
  /// The value of an expression of parameters and literals.
  double number_of(const stencil::Expr& e) const;
  std::vector<NumberMonomial> numbers_of(const stencil::Expr& symbol) const;
  void transform(const stencil::Transform& transform);
  WaveMultiplier multiplier_of(const stencil::Transform::Term& term) const;
  void add_waves_of(const stencil::Transform::Term& term, const WaveMultiplier& by, Value& result, WaveSum& waves,
                    std::array<WaveSum, 3>& slopes);
  void add_waves(LinearForm& to, WaveSum waves);
  /// `unknown`: its name in the model.
  Value solved(const std::string& field, const std::string& unknown) const;
  void run_block(const stencil::Solve& solve);
  void solve(const stencil::Solve& solve);
  void solve_coupled(const stencil::Solve& solve);
  void solve_by_newton(const stencil::Solve& solve);
  void repeat(const stencil::Repeat& repeat);

  const FrozenKernels& kernels_;
  const std::set<std::string>&varied_, &rates_;
  NumbersOfStep numbers_;
  FrozenStages& stages_;
  const bool of_constraints_;
  std::size_t runs_ = 0;       // runs so far of kernels that compute states
  std::array<int, 3> base_{};  // offset from the point of the cell at which a kernel is evaluated
  std::vector<Value> fields_, locals_;
  FormSum sum_;               // the form under construction; reuses its memory
  std::vector<bool> is_set_;  // fields
  std::vector<WaveSum> waves_;
  bool is_too_far_ = false;
  double displacement_ = 0;  // in cells, the largest
};

}  // namespace dpde::stability
