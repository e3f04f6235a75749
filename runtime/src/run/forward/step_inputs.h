// SPDX-License-Identifier: Apache-2.0
// What programs are given in a step or at a state: its time and length, and controls. Inside the runtime only.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "dpde/runtime/rollout.h"
#include "run/bound_program.h"

namespace dpde {

/// A Courant number, a tolerance, or the parts of another rollout.
inline bool has_parts(const RolloutSetup& setup) {
  return setup.rate != nullptr || setup.trial != nullptr || setup.follows;
}

class StepInputs {
 public:
  explicit StepInputs(const ResolvedSetup& setup) : setup_(setup), t0_(setup.t0), sets_dt_(has_parts(setup)) {}

  double time(int step) const { return t0_ + step * setup_.dt; }
  void set_begin(double t0) { t0_ = t0; }
  /// Its number among the controls, where it is a new one.
  std::optional<size_t> set_control(ValueId id, int every, std::span<const double> values);

  /// Time and controls in step n, or of a loss at state n, and whatever parameters have been set since.
  void set(BoundProgram& program, int n) const { set(program, n, {0, setup_.dt}); }
  void set(BoundProgram& program, int n, const PartOfStep& part) const;
  void bind_control_fields(BoundProgram& program, int n) const;
  /// The first step behind n at which a control field has another interval.
  int end_of_intervals(int n) const;

  /// A solve that finds nothing says in which step, and when the part of it begins that it belongs to.
  void run_in_step(Executor& executor, int n, double begin = 0) const;
  /// And one of a loss, at which time.
  void run_at_state(Executor& executor, int k) const;

 private:
  /// A parameter that has values[n / every] in step n, the last one beyond.
  struct Control {
    ValueId id;
    int every;
    std::vector<double> values;
    double at(int n) const { return values[control_interval(n, every, values.size())]; }
  };

  const ResolvedSetup& setup_;
  double t0_;
  const bool sets_dt_;
  std::vector<Control> controls_;
};

}  // namespace dpde
