// SPDX-License-Identifier: Apache-2.0
// What steps and losses say of parameters, weights and fields of the caller, added up. Inside the runtime only.
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
  /// Into `result`: bars of parameters, controls and sought fields.
  /// @throws Error(input) for control fields without intervals or fields.
  GradientSums(const ResolvedSetup& setup, GradientResult& result);

  // Preparation
  /// Sums of an adjoint; parameters that no other has get a place.
  std::vector<ParamBar> bind_params(const dpde_program& adjoint);
  /// Results of an adjoint.
  std::vector<FieldBar> bind_fields(const dpde_program& adjoint) const;
  /// `adds`: adjoints add to the gradient by the weights.
  /// @throws Error(run) naming what is not bound.
  void bind_weights(Executor& executor, bool adds = true);
  /// Once all adjoints have said which there are.
  void size_params();
  void allocate(RunMemory& memory);
  void set_control(ValueId id, int every, size_t intervals);

  // In a gradient
  void begin();
  /// Of a control the share of step n goes to its interval.
  void add_params(std::span<const double> sums, const std::vector<ParamBar>& params, int n);
  /// Of a control field, too.
  void add_fields(const Executor& executor, const std::vector<FieldBar>& fields, int n);
  /// Where the sum of sought field `number` is kept in step n; doubles.
  void* field(size_t number, int n) const { return pool_.base(static_cast<int64_t>(sought_[number].at(n))); }
  /// Whether steps n and n - 1 add to the same one.
  bool continues(size_t number, int n) const { return sought_[number].at(n) == sought_[number].at(n - 1); }

  // Afterwards
  const std::vector<std::string>& param_names() const { return param_names_; }
  ValueId param_id(size_t param) const { return params_[param]; }
  FieldView field_bar(ValueId field) const;
  /// False where it is none.
  bool copy_field_bar(ValueId field, std::span<double> to) const;
  void copy_param_bar(ValueId param, std::span<double> to) const;
  void copy_rate_bar(ValueId network, std::span<double> to) const;

 private:
  /// A control field has one place an interval, from the first on.
  struct SoughtField {
    size_t first = 0, count = 1;  // in GradientResult::field_bars
    int every = 0;                // of a control field
    size_t at(int n) const { return every == 0 ? first : first + control_interval(n, every, count); }
  };
  /// By the weights of a network that is learned, and by their rates.
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
  std::deque<WeightBars> weights_;  // a deque: programs add to them
  std::vector<SoughtField> sought_;
  dpde_layout layout_{};  // that of the states, but of doubles
  FieldPool pool_;        // one a sought field, or one an interval of it
};

}  // namespace dpde
