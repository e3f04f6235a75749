// SPDX-License-Identifier: Apache-2.0
// Runs of the step's tangent (coupled_means.h) have each cell of the scene in each of their steps. Where these are more
// than a verdict may take, the same is looked at on two coarser grids of the scene's own domain. Limits L fall as a
// power of the cells n along an axis: by the first where what is carried limits the step, by the second where a bracket
// folds back or something spreads. Of the two grids the power is known, and L is taken on to the scene's cells:
//   L(n) = L(m) (m/n)^p,  p = log2(L(m/2) / L(m)).
//
// The budget is counted in values that steps make, and not in seconds: a verdict is the same on every machine.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "driver/session.h"
#include "stability/compiled_tangent.h"
#include "stability/frozen_points.h"
#include "stability/linear_step.h"

namespace dpde::stability {

struct Verdict;

/// What the step's tangent makes in a cell: a value for each store of a kernel, and for transforms and solves as many
/// as take the same time.
double values_a_cell(const LinearStep& linear);

class CoarseRuns {
 public:
  /// Of a search on all grids together: some three seconds of one core.
  static constexpr double most_values = 2e9;
  static constexpr int steps_of_run = 60;
  /// How many steps such a search makes, on the larger grid alone.
  static constexpr double steps_of_search = 30.0 * steps_of_run;

  /// null where runs on the scene's own cells are within the budget or not needed, and where coarser ones cannot be
  /// had: on stretched axes, where events end each step, and where the tangent cannot be compiled.
  static std::unique_ptr<CoarseRuns> make(driver::Session& session, const LinearStep& linear, const FrozenPoint& point);

  /// Of the larger grid.
  double cells() const { return cells_; }
  struct Limit {
    double step = 0;    // on the scene's cells; infinite: none was found; 0: every step is unstable
    double factor = 1;  // steps of the larger grid that do the same are so much longer
  };
  /// `guess`: where it may be.
  Limit limit(double guess) const;
  /// ln |g| of what grows most in a step of the larger grid.
  double growth(double step) const;

 private:
  struct OnCells {
    stencil::State inputs;
    stencil::Params params;
  };
  explicit CoarseRuns(std::unique_ptr<CompiledTangent> tangent) : tangent_(std::move(tangent)) {}
  /// ln of what a random disturbance is multiplied by in as many steps; infinite where it leaves the range of numbers.
  double grown(const OnCells& on, double step, int steps) const;
  /// In runs of this step it grows no more than a hundredfold beyond twice what short steps make of it.
  bool is_stable(const OnCells& on, double step) const;
  double largest_stable(const OnCells& on, double guess) const;

  std::unique_ptr<CompiledTangent> tangent_;
  std::vector<OnCells> grids_;  // the larger one first
  double cells_ = 0;
  int halvings_ = 0;  // from the scene's cells to the larger grid's
};

/// The verdict with what these runs find, which is an estimate: a limit is lowered where they find one that is lower by
/// more than they may err. Then it is of means, and not of runs on the scene's grid.
void lower_by(const CoarseRuns& runs, Verdict& verdict);

}  // namespace dpde::stability
