// SPDX-License-Identifier: Apache-2.0
// Runs until steady, and their gradient by the implicit function theorem: x = S(x, p) for the step S, so
//
//   (I - S_x^T)*lambda = x_bar,   p_bar += S_p^T*lambda
//
// with x_bar from the losses. The adjoint of one step gives S_x^T*lambda and S_p^T*lambda. GMRES solves the linear
// system, so that no trajectory is stored or reversed. Rates are the fixed point of the tangent step, v = S_x*v +
// S_p*p_dot, by the same method. Inside the runtime only.
#pragma once

#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "run/forward/run_watch.h"
#include "run/forward/step_inputs.h"
#include "run/forward/stepper.h"
#include "run/reverse/way_back.h"
#include "run/states.h"
#include "solve/operator/krylov.h"

namespace dpde {

/// Accuracy of a linear solve, relative to its right side: `tolerance`, or rounding if that is at most
/// `most_by_rounding`.
struct LinearAccuracy {
  double tolerance, rounding, most_by_rounding;
  /// For derivatives by central differences: two thirds of the digits remain, with a step of length().
  LinearAccuracy of_differences(double enough) const {
    return {enough, std::pow(rounding, 2.0 / 3), std::pow(most_by_rounding, 2.0 / 3)};
  }
  double length() const { return std::cbrt(rounding); }
};

class SteadyRun {
 public:
  SteadyRun(const ResolvedSetup& setup, const StepInputs& inputs, States& states, Stepper& stepper, RunWatch& watch);

  /// Largest change of all states except rates, per unit of time.
  double largest_change(const StateBuffer& from, const StateBuffer& to) const;
  /// Whether all changes are within the tolerance; stops reading at the first row where one is not.
  bool is_still(const StateBuffer& from, const StateBuffer& to) const;
  /// The step whose adjoint is used for the steady state.
  int last_step() const { return std::max(setup_.steps - 1, 0); }

  /// Runs from the initial state; its end becomes the current state. Returns nothing when stopped, or if values are not
  /// finite.
  /// @throws Unsolved if the steps are not enough.
  std::optional<Steady> run();
  /// Whether runs continue to the state x = S(x) by Newton's method.
  void end_at_rest(bool ends_at_rest) { ends_at_rest_ = ends_at_rest; }
  /// Whether the last of these calls was stopped.
  bool was_stopped() const { return was_stopped_; }
  /// S(x) - x for the current state, all states one after the other.
  std::vector<double> unrest();
  /// Replaces the seeds by lambda, unless stopped. To first order the fixed point is x + (I - S_x)^-1*(S(x) - x), and
  /// the loss there is larger by lambda*(S(x) - x).
  SteadyAdjoint solve_adjoint(WayBack& back, std::span<const double> unrest);

 private:
  bool goes_on(int state, bool is_back);
  std::vector<double> values_of(const StateBuffer& state) const;
  void set(std::span<const double> values);
  std::vector<double> sizes_of(std::span<const double> values, std::span<const double> otherwise) const;
  bool move_to_rest();
  std::optional<Steady> find_rates();
  bool solve_fixed_point(const VectorFunction& step, std::span<const double> b, std::span<double> x, bool is_back,
                         const LinearAccuracy& accuracy, SteadyAdjoint& report);

  const RolloutSetup& setup_;
  const StepInputs& inputs_;
  States& states_;
  Stepper& stepper_;
  RunWatch& watch_;
  std::vector<char> is_rate_;  // of each state: see RolloutSetup::rates
  bool was_stopped_ = false, ends_at_rest_ = false;
  int products_of_adjoint_ = 0;  // of the last solve_adjoint()
};

}  // namespace dpde
