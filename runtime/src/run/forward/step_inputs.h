// SPDX-License-Identifier: Apache-2.0
// Inputs of programs in a step or at a state: time, step length, and controls. Inside the runtime only.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "dpde/runtime/rollout.h"
#include "run/bound_program.h"

namespace dpde {

/// Whether steps are split: by a Courant number, a tolerance, or the record of another rollout.
inline bool has_parts(const RolloutSetup& setup) {
  return setup.rate != nullptr || setup.trial != nullptr || setup.follows;
}

class StepInputs {
 public:
  explicit StepInputs(const ResolvedSetup& setup) : setup_(setup), t0_(setup.t0), sets_dt_(has_parts(setup)) {}

  double time(int step) const { return t0_ + step * setup_.dt; }
  void set_begin(double t0) { t0_ = t0; }
  /// Returns its index among the controls if it is a new one.
  std::optional<size_t> set_control(ValueId id, int every, std::span<const double> values);

  /// Sets time and controls for step n, or for a loss at state n, and applies changed parameters.
  void set(BoundProgram& program, int n) const { set(program, n, {0, setup_.dt}); }
  void set(BoundProgram& program, int n, const PartOfStep& part) const;
  void bind_control_fields(BoundProgram& program, int n) const;
  /// The first step after n with another interval of a control field.
  int end_of_intervals(int n) const;

  /// Adds to the error of a failed solve the step and the begin of the substep.
  void run_in_step(Executor& executor, int n, double begin = 0) const;
  /// The same for a loss, with its time.
  void run_at_state(Executor& executor, int k) const;

 private:
  /// A parameter that is values[n / every] in step n, then the last value.
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
