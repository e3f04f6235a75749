// SPDX-License-Identifier: Apache-2.0
#include "run/forward/step_inputs.h"

#include <algorithm>
#include <limits>

#include "dpde/runtime/unsolved.h"

namespace dpde {

std::optional<size_t> StepInputs::set_control(ValueId id, int every, std::span<const double> values) {
  auto control = std::ranges::find(controls_, id, &Control::id);
  const bool is_new = control == controls_.end();
  if (is_new) control = controls_.insert(control, {id, every, {}});
  control->every = every;
  control->values.assign(values.begin(), values.end());
  return is_new ? std::optional(controls_.size() - 1) : std::nullopt;
}

void StepInputs::set(BoundProgram& program, int n, const PartOfStep& part) const {
  bind_control_fields(program, n);
  if (program.t_param >= 0) program.executor.set_param(program.t_param, time(n) + part.begin);
  if (sets_dt_ && program.dt_param >= 0) program.executor.set_param(program.dt_param, part.length);
  for (const auto& [param, number] : program.controls) {
    program.executor.set_param(param, controls_[number].at(n));
  }
  program.executor.update_uniforms();
}

/// Binds the fields of the interval that contains step n, or a loss at state n. Halos are filled at the begin of an
/// interval, since its field may have changed.
void StepInputs::bind_control_fields(BoundProgram& program, int n) const {
  for (const auto& [field, number] : program.control_fields) {
    const ControlField& control = setup_.control_fields[number];
    void* const now = control.at[control_interval(n, control.every, control.at.size())];
    if (program.executor.bound(field) == now) continue;
    program.executor.bind(field, now);
    if (program.executor.prepares(field)) program.executor.prepare(field);
  }
}

int StepInputs::end_of_intervals(int n) const {
  int end = std::numeric_limits<int>::max();
  for (const ControlField& control : setup_.control_fields) {
    const size_t next = control_interval(n, control.every, control.at.size()) + 1;
    if (next < control.at.size()) end = std::min(end, static_cast<int>(next) * control.every);
  }
  return end;
}

void StepInputs::run_in_step(Executor& executor, int n, double begin) const {
  try {
    executor.run();
  } catch (Unsolved& error) {
    error.set_place(n + 1, setup_.steps, time(n) + begin);
    throw;
  }
}

void StepInputs::run_at_state(Executor& executor, int k) const {
  try {
    executor.run();
  } catch (Unsolved& error) {
    error.set_place(0, setup_.steps, time(k));
    throw;
  }
}

}  // namespace dpde
