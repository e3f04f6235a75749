// SPDX-License-Identifier: Apache-2.0
// Sums over steps and losses of the gradients by parameters, weights and fields of the caller. Inside the runtime only.
#pragma once

#include <deque>
#include <span>
#include <string>
#include <vector>

#include "dpde/runtime/rollout.h"
#include "run/bound_program.h"
#include "run/run_memory.h"

namespace dpde {

class GradientSums {
 public:
  /// Writes to `result`: adjoints of parameters, controls and unknown fields.
  /// @throws Error(input) for control fields without intervals or fields.
  GradientSums(const ResolvedSetup& setup, GradientResult& result);

  // Preparation
  /// Registers the sums of an adjoint; new parameters are added to the list.
  std::vector<ParamBar> bind_params(const dpde_program& adjoint);
  /// The results of an adjoint.
  std::vector<FieldBar> bind_fields(const dpde_program& adjoint) const;
  /// `adds`: adjoints add to the gradient with respect to the weights.
  /// @throws Error(run) with the name of a missing binding.
  void bind_weights(Executor& executor, bool adds = true);
  /// Call once all adjoints are registered.
  void size_params();
  void allocate(RunMemory& memory);
  void set_control(ValueId id, int every, size_t intervals);

  // In a gradient
  void begin();
  /// For a control, adds the contribution of step n to its interval.
  void add_params(std::span<const double> sums, const std::vector<ParamBar>& params, int n);
  /// The same for control fields.
  void add_fields(const Executor& executor, const std::vector<FieldBar>& fields, int n);
  /// Memory of the sum of unknown field `number` in step n; doubles.
  void* field(size_t number, int n) const { return pool_.base(static_cast<int64_t>(sought_[number].at(n))); }
  /// Whether steps n and n - 1 add to the same sum.
  bool continues(size_t number, int n) const { return sought_[number].at(n) == sought_[number].at(n - 1); }

  // Afterwards
  const std::vector<std::string>& param_names() const { return param_names_; }
  ValueId param_id(size_t param) const { return params_[param]; }
  FieldView field_bar(ValueId field) const;
  /// Returns false if there is none.
  bool copy_field_bar(ValueId field, std::span<double> to) const;
  void copy_param_bar(ValueId param, std::span<double> to) const;
  void copy_rate_bar(ValueId network, std::span<double> to) const;

 private:
  /// A control field has one entry for each interval.
  struct SoughtField {
    size_t first = 0, count = 1;  // in GradientResult::field_bars
    int every = 0;                // of a control field
    size_t at(int n) const { return every == 0 ? first : first + control_interval(n, every, count); }
  };
  /// For the weights of a learned network, and for their rates.
  struct WeightBars {
    ValueId network;
    std::vector<double> values, rates;
  };
  const SoughtField* find_sought(ValueId field) const;
  const WeightBars* find_weights(ValueId network) const;

  const ResolvedSetup& setup_;
  GradientResult& result_;
  std::vector<ValueId> params_;
  std::vector<std::string> param_names_;
  std::vector<int> control_every_;  // steps an interval, for those that are controls
  std::deque<WeightBars> weights_;  // a deque keeps addresses: programs add to them
  std::vector<SoughtField> sought_;
  dpde_layout layout_{};  // that of the states, but with doubles
  FieldPool pool_;        // one for each unknown field, or for each of its intervals
};

}  // namespace dpde
