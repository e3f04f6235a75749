// SPDX-License-Identifier: Apache-2.0
// A scene's equations about a frozen point, by other differences or steps than the scene's own.
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

/// The states' perturbations in a step of a problem, lowered anew; not of hand-written programs. Where ways of the flow
/// end on walls it is the step as it is away from these, on rings. Here and below: of the states of `group` alone.
std::optional<LinearStep> linear_step(const model::Problem& problem, const StateGroup& group = {});
/// Those in the step that was compiled, without events that only some steps have; `why` as of LinearStep::make, and
/// where a network is in it.
std::optional<LinearStep> linear_step(const driver::Session& session, std::string& why, const StateGroup& group = {});
/// The same with linear interpolation in the place of steps that are clamped. A clamp that is frozen as the run begins
/// would hold a cell at one of its bounds in all steps: at a wall that is what lies beyond, which `linear` lets grow.
std::optional<LinearStep> step_without_clamps(const model::Problem& problem, const StateGroup& group = {});
/// Those of that step which depend on one another.
std::vector<StateGroup> state_groups(const driver::Session& session);
/// With networks, too.
std::optional<LinearStep> compiled_step(const driver::Session& session, std::string& why, const StateGroup& group = {});
/// One a group of states of the problem's step; none where one of them cannot be had.
std::vector<LinearStep> linear_steps(const model::Problem& problem);

/// Whether each step ends with it.
bool is_of_each_step(const model::Event& event, const model::Problem& problem);
/// Whether each step ends with something that the scene does to its states.
/// Whether only some steps have an event: verdicts are of the others.
bool has_rare_events(const model::Problem& problem);
bool has_events_in_each_step(const model::Problem& problem);

/// The problem by one step of Euler's method, without events and steps of their own: u + dt*L u, L being the equations
/// as the scheme's differences have them.
model::Problem by_euler(model::Problem problem);

/// L about the point, 1/time, of such a step. nullopt where it is not finite.
std::optional<LinearisedStep> generator_of(const LinearStep& euler, const FrozenPoint& point);

/// What the equations about a point do to waves without a grid: eigenvalues of the same equations by differences of
/// order 8 on cells of a sixteenth.
class Symbol {
 public:
  /// `rates`: on such cells.
  Symbol(const LinearisedStep& rates, int rank) : rates_(rates, rank) {}
  /// Angles are those of the scene's cells.
  Eigen::VectorXcd eigenvalues(Angles angles) const;
  double growth_rate(const Angles& angles) const { return eigenvalues(angles).real().maxCoeff(); }

 private:
  Amplification rates_;
};

/// The equations of a problem for a group of its states; they are lowered when they are first asked for.
class Equations {
 public:
  explicit Equations(model::Problem problem, StateGroup group = {});
  /// nullopt where they cannot be taken so.
  std::optional<Symbol> about(const FrozenPoint& point) const;
  /// What is stiff has no limit by these schemes, what is not may have one far off.
  bool are_stepped_exponentially() const { return model::is_exponential(problem_.scheme.time); }
  double length_of_run() const { return problem_.steps * problem_.step; }
  /// What a step may be of its rates; not known where its scheme makes no function of them.
  StepOfRates step_of_rates() const;
  /// Of which rates, or memories of them, the rows of a step are; none where one of them is of neither.
  std::vector<StepOfRates::Place> places_in(const LinearStep& step) const;
  /// L about the point by the scheme's own differences; nullopt where it cannot be had.
  std::optional<LinearisedStep> rates_at(const FrozenPoint& point) const;
  /// All differences are Fourier series: what waves of any length do by the step's rates is what the equations do.
  bool are_spectral() const;
  /// The scene's step without events; null where it has none in each step.
  const LinearStep* without_events() const { return without_events_ ? &*without_events_ : nullptr; }

  /// A step of Euler's method by the scheme's own differences; null where it cannot be had.
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

/// The point with the values of its fields everywhere about it; what is solved for keeps its slopes, a wind as an
/// example.
FrozenPoint flat(FrozenPoint point);

/// The sum of the magnitudes of all coefficients.
double magnitude_of(const LinearisedStep& rows);

}  // namespace dpde::stability
