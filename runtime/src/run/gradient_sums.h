// SPDX-License-Identifier: Apache-2.0
// What steps and losses say of parameters, weights and fields of the caller, added up. Inside the runtime only.
#pragma once

#include <deque>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/runtime/rollout.h"
#include "run/bound_program.h"
#include "run/run_memory.h"

namespace dpde {

class GradientSums {
 public:
  /// Into `result`: bars of parameters, controls and sought fields.
  /// @throws Error(input) for control fields without intervals or fields.
  GradientSums(const RolloutSetup& setup, GradientResult& result);

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
  void set_control(std::string_view name, int every, size_t intervals);

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

  // Afterwards, by name
  const std::vector<std::string>& params() const { return params_; }
  FieldView field_bar(std::string_view field) const;
  /// False where it is none.
  bool copy_field_bar(std::string_view field, std::span<double> to) const;
  void copy_param_bar(std::string_view param, std::span<double> to) const;
  void copy_rate_bar(std::string_view network, std::span<double> to) const;

 private:
  /// A control field has one place an interval, from the first on.
  struct SoughtField {
    size_t first = 0, count = 1;  // in GradientResult::field_bars
    int every = 0;                // of a control field
    size_t at(int n) const { return every == 0 ? first : first + control_interval(n, every, count); }
  };
  /// By the weights of a network that is learned, and by their rates.
  struct WeightBars {
    std::string network;
    std::vector<double> values, rates;
  };
  const SoughtField* find_sought(std::string_view field) const;

  const RolloutSetup& setup_;
  GradientResult& result_;
  std::vector<std::string> params_;
  std::vector<int> control_every_;  // steps an interval, for those that are controls
  std::deque<WeightBars> weights_;  // a deque: programs add to them
  std::vector<SoughtField> sought_;
  dpde_layout layout_{};  // that of the states, but of doubles
  FieldPool pool_;        // one a sought field, or one an interval of it
};

}  // namespace dpde
