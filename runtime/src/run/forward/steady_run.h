// SPDX-License-Identifier: Apache-2.0
// Runs until steady, and the gradient there by the implicit function theorem: where x = S(x, p) for the step S,
//
//   (I - S_x^T)*lambda = x_bar,   p_bar += S_p^T*lambda
//
// with x_bar of the losses. The adjoint of one step gives S_x^T*lambda and S_p^T*lambda; the linear system is solved by
// GMRES, so that no trajectory is stored or gone back. Rates are what the tangent step leaves as they are,
// v = S_x*v + S_p*p_dot, by the same method. Inside the runtime only.
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

/// How well a linear system is solved, relative to its right side: to `tolerance`, or to what rounding leaves, where
/// that is at most `most_by_rounding`.
struct LinearAccuracy {
  double tolerance, rounding, most_by_rounding;
  /// Where derivatives are central differences: two thirds of the digits are left, with a step of length().
  LinearAccuracy of_differences(double enough) const {
    return {enough, std::pow(rounding, 2.0 / 3), std::pow(most_by_rounding, 2.0 / 3)};
  }
  double length() const { return std::cbrt(rounding); }
};

class SteadyRun {
 public:
  SteadyRun(const ResolvedSetup& setup, const StepInputs& inputs, States& states, Stepper& stepper, RunWatch& watch);

  /// Of all states but rates, a unit of time.
  double largest_change(const StateBuffer& from, const StateBuffer& to) const;
  /// Reads no further than to the first row that is not.
  bool is_still(const StateBuffer& from, const StateBuffer& to) const;
  /// The step whose adjoint is that of the steady state.
  int last_step() const { return std::max(setup_.steps - 1, 0); }

  /// From the initial state; the current one is then where it ends. Nothing when stopped, or where values are not
  /// finite.
  /// @throws Unsolved where the steps are not enough.
  std::optional<Steady> run();
  /// Whether runs go on from there to the state x = S(x), by Newton's method, in place of more steps.
  void end_at_rest(bool ends_at_rest) { ends_at_rest_ = ends_at_rest; }
  /// Whether somebody wanted no more, in the last of these calls.
  bool was_stopped() const { return was_stopped_; }
  /// S(x) - x of the current state, all states one behind the other.
  std::vector<double> unrest();
  /// The seeds become lambda, unless stopped. To first order the state comes to rest at x + (I - S_x)^-1*(S(x) - x),
  /// where the loss is larger by lambda*(S(x) - x).
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
