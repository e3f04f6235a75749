// SPDX-License-Identifier: Apache-2.0
// A scene's equations linearised about a frozen point, with differences or time steps other than the scene's own.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "model/model.h"
#include "stability/step/linear_step.h"
#include "stability/waves/amplification.h"
#include "stability/waves/step_of_rates.h"

namespace dpde::stability {

/// The linear step of a problem, lowered anew; nullopt for hand-written programs. If trajectories of the flow end on
/// walls, it is the step on periodic axes. Here and below only the states of `group` are perturbed.
std::optional<LinearStep> linear_step(const model::Problem& problem, const StateGroup& group = {});
/// The linear step of the compiled step, without events that only some steps have. `why` is set as by LinearStep::make,
/// and if the step has a network.
std::optional<LinearStep> linear_step(const driver::Session& session, std::string& why, const StateGroup& group = {});
/// The same with linear interpolation instead of clamped advection. A clamp frozen at the start of the run would hold a
/// cell at one of its bounds in all steps. At a wall the bound is a ghost value, which `linear` lets grow.
std::optional<LinearStep> step_without_clamps(const model::Problem& problem, const StateGroup& group = {});
/// The groups of states of the compiled step that depend on one another.
std::vector<StateGroup> state_groups(const driver::Session& session);
/// As linear_step, but networks are allowed.
std::optional<LinearStep> compiled_step(const driver::Session& session, std::string& why, const StateGroup& group = {});
/// One linear step for each group of states; empty if one of them cannot be made.
std::vector<LinearStep> linear_steps(const model::Problem& problem);

/// Whether the event ends each step.
bool is_of_each_step(const model::Event& event, const model::Problem& problem);
/// Whether some event is only in some of the steps. Verdicts leave such events out.
bool has_rare_events(const model::Problem& problem);
/// Whether some event ends each step.
bool has_events_in_each_step(const model::Problem& problem);

/// The problem with Euler's method, without events and substeps: u + dt*L u, where L are the equations with the
/// scheme's spatial differences.
model::Problem by_euler(model::Problem problem);

/// L of such an Euler step about the point, in 1/time; nullopt if it is not finite.
std::optional<LinearisedStep> generator_of(const LinearStep& euler, const FrozenPoint& point);

/// The symbol of the equations about a point, as if without a grid: eigenvalues with differences of order 8 on cells of
/// a sixteenth of the scene's spacing.
class Symbol {
 public:
  /// `rates`: L on these fine cells.
  Symbol(const LinearisedStep& rates, int rank) : rates_(rates, rank) {}
  /// Angles are in radians per cell of the scene.
  Eigen::VectorXcd eigenvalues(Angles angles) const;
  double growth_rate(const Angles& angles) const { return eigenvalues(angles).real().maxCoeff(); }

 private:
  Amplification rates_;
};

/// The equations of a problem for a group of its states, lowered at first use.
class Equations {
 public:
  explicit Equations(model::Problem problem, StateGroup group = {});
  /// The symbol about the point; nullopt if it cannot be made.
  std::optional<Symbol> about(const FrozenPoint& point) const;
  /// Whether the scheme is an exponential integrator: stiff terms then set no limit, others may set a distant one.
  bool are_stepped_exponentially() const { return model::is_exponential(problem_.scheme.time); }
  double length_of_run() const { return problem_.steps * problem_.step; }
  /// The step as a function of L; unknown if the scheme is no such function.
  StepOfRates step_of_rates() const;
  /// For each row of the step: its row in L and how many steps back it is stored. Empty if a row has no such place.
  std::vector<StepOfRates::Place> places_in(const LinearStep& step) const;
  /// L about the point with the scheme's own differences; nullopt if it cannot be made.
  std::optional<LinearisedStep> rates_at(const FrozenPoint& point) const;
  /// Whether all derivatives are spectral: L is then exact for waves of any length.
  bool are_spectral() const;
  /// The scene's step without events; null if no event ends each step.
  const LinearStep* without_events() const { return without_events_ ? &*without_events_ : nullptr; }

  /// An Euler step with the scheme's own differences; null if it cannot be made.
  const LinearStep* by_euler_steps() const;

 private:
  model::Problem problem_;
  StateGroup group_;
  std::optional<LinearStep> without_events_;
  mutable bool is_made_ = false;  // fine_: a cache
  mutable std::optional<LinearStep> fine_;
  mutable bool is_euler_made_ = false;  // likewise
  mutable std::optional<LinearStep> euler_;
};

/// The point with all slopes of its fields set to 0. Solutions of solves, as a wind, keep their slopes.
FrozenPoint flat(FrozenPoint point);

/// The sum of |coefficient| over all rows.
double magnitude_of(const LinearisedStep& rows);

}  // namespace dpde::stability
