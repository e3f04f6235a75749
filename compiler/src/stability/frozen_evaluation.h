// SPDX-License-Identifier: Apache-2.0
// One run of a step's tangent at a frozen point, with sums of displaced perturbations in place of numbers.
#pragma once

#include <array>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "stability/linear_step.h"

namespace dpde::stability {

inline constexpr double unknown_value = std::numeric_limits<double>::quiet_NaN();

/// The value at the point, its change from cell to cell, and how it is perturbed.
struct Value {
  double number = 0;
  Form form = {};
  std::array<double, 3> slope = {};  // of fields; no expression has one
};

class Evaluation {
 public:
  /// `varied`: fields that depend on the states; `rates`: their perturbations.
  Evaluation(const stencil::Module& module, const std::set<std::string>& varied, const std::set<std::string>& rates,
             const FrozenPoint& point, double dt, FrozenStages& stages, bool of_constraints)
      : module_(module),
        varied_(varied),
        rates_(rates),
        point_(point),
        dt_(dt),
        stages_(stages),
        of_constraints_(of_constraints) {}

  void perturb(const std::string& field, int component) { fields_[field] = {0, Form(component)}; }
  void run(const std::vector<stencil::Statement>& body);
  const Value& at(const std::string& field) { return field_value(field); }
  bool is_too_far() const { return is_too_far_; }
  double displacement() const { return displacement_; }
  std::vector<WaveSum> take_waves() { return std::move(waves_); }

 private:
  const Value& field_value(const std::string& name);
  double parameter(const std::string& name) const;
  Value access(const std::string& name, const stencil::Offset& offset);
  Value interpolate(const stencil::Interp& interp);
  Value binary(const stencil::Binary& b);
  Value value(const stencil::Expr& e);
  struct Condition {
    double truth = 0;  // 1, 0, or not known
    bool is_tie = false;
  };
  Condition condition_of(const stencil::Expr& e);
  Condition compared(const stencil::Expr& e);
  Value select(const stencil::Select& s);
  std::vector<Value> stored_values(const stencil::Kernel& kernel);
  std::optional<std::vector<FrozenValue>> frozen_values(const stencil::Kernel& kernel);
  std::optional<std::vector<Value>> values_of_states(const stencil::Kernel& kernel);
  void run_kernel(const stencil::Kernel& kernel);
  void reduce(const stencil::Reduce& reduce);
  std::vector<NumberMonomial> numbers_of(const stencil::Expr& symbol);
  void transform(const stencil::Transform& transform);
  void add_waves(Value& to, WaveSum waves);
  /// `unknown`: what the model calls it.
  Value solved(const std::string& field, const std::string& unknown) const;
  void run_block(const stencil::Solve& solve);
  void solve(const stencil::Solve& solve);
  void solve_coupled(const stencil::Solve& solve);
  void solve_by_newton(const stencil::Solve& solve);
  void repeat(const stencil::Repeat& repeat);

  const stencil::Module& module_;
  const std::set<std::string>&varied_, &rates_;
  const FrozenPoint& point_;
  double dt_;
  FrozenStages& stages_;
  const bool of_constraints_;
  std::size_t runs_ = 0;       // of kernels that make states
  std::array<int, 3> base_{};  // the cell that a kernel is run at, from the point
  std::map<std::string, Value> fields_, locals_;
  std::map<std::string, double> counters_;
  std::vector<WaveSum> waves_;
  bool is_too_far_ = false;
  double displacement_ = 0;  // in cells, the largest
  bool is_late_ = false;     // t stands for any time behind the first steps
};

}  // namespace dpde::stability
