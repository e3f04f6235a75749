// SPDX-License-Identifier: Apache-2.0
// Means and sums of perturbations that count by other fields, as that of u^2, whose tangent is the mean of 2 u u'. They
// tie each cell to all others, each in another way, and no wave at a frozen point stands for them. So do plain means
// that act in one way at some places and in another at others, as inside a mask. The analysis of waves leaves them out;
// runs of the step's tangent about the initial state on the scene's own grid have them. So they
// have what curved coordinates are, which no wave and no wall with frozen coefficients is: cells that become narrow
// towards a pole, and what lies beyond it.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stability/frozen/frozen_points.h"
#include "stability/step/linear_step.h"
#include "stability/step/tangent_runs.h"
#include "stability/waves/coupled_flow.h"

namespace dpde::stability {

/// The module with 0 in the place of these means, in its first program. `rates`: fields of perturbations.
stencil::Module without_coupled_means(stencil::Module module, const std::set<std::string>& rates);

/// With 0 in the place of all means and sums of perturbations.
stencil::Module without_means(stencil::Module module, const std::set<std::string>& rates);

/// With all means left to runs where they add something else at other places, or at other times, and runs can have
/// them. Then the mean of all cells is no wave: its factor at one point, as inside a mask, would be that of a grid that
/// is all like it.
LinearStep with_means_of_runs(driver::Session& session, const LinearStep& linear, double step);

/// The worst point, and the same at a few other times of the points: what moves, as a mask does, stands still in runs.
std::vector<FrozenPoint> moments_of(const FrozenPoint& worst, const std::vector<ScenePoint>& points);

/// What grows is of the grid: fewer cells than differences follow, and no step is short enough.
struct ShortWaves {
  double rate = 0;   // of growth, 1/time
  double cells = 0;  // of a wave
};

class CoupledRuns {
 public:
  /// Where the step has such means, the scene curved coordinates, or products fold back (folded_products.h). null where
  /// there is none of these, or the step's tangent cannot be compiled. `euler`: a step of it of the same equations,
  /// which tells what they do by themselves; where it is null, or makes no flow, short steps of the scheme do.
  /// `own_step`: the scene's, or that of the parts of it.
  static std::unique_ptr<CoupledRuns> make(driver::Session& session, const LinearStep& linear, const FrozenPoint& point,
                                           bool has_events, double own_step, const LinearStep* euler = nullptr);

  /// Where nothing but products that fold back asks for runs, and cells are so many that these take more than some
  /// seconds: nothing shorter tells limits. What so few steps can show a run itself shows as soon.
  static bool are_too_long(driver::Session& session, const LinearStep& linear);

  /// Whether random disturbances grow no more than a hundredfold beyond what events do, and twice what the equations do
  /// beside these in the same time; and no eigenvalue of the step that is found grows at all beyond that, which so few
  /// steps may not show. What has grown in a longer step that was asked about is looked at, too: in noise a few steps
  /// do not tell it near its limit.
  bool is_stable(double step) const;
  /// Where what has grown in an unstable step begins to grow beyond events and twice what the equations let grow, up to
  /// `precision` of it: a guess of the limit, as others may grow in shorter steps. 0: none.
  double begins_to_grow(double unstable, double precision) const;
  /// ln |g| of what grows most.
  double growth(double step) const;
  /// Of growth that rises as a power of the step, so that it is no limit up to which nothing is told of it; else 0.
  double power_of_growth(double limit) const;
  /// As which power of the step growth beyond that of the equations rises about this one; 0 where it is not known.
  double order_of_growth(double step) const;
  /// From where longer steps are looked at: so short that each rate is resolved; 0 where these are not known.
  double surely_short() const { return flow_ ? 0.25 * flow_->step() : 0; }
  /// 1/time: of what grows by more than a hundredfold in short steps; 0 where nothing does.
  double growth_rate(double step) const;
  /// 1/time: how what is left after half of a run grows in the other half, by short steps.
  double late_growth_rate(double step) const;
  double growth_by_events() const { return by_events_; }
  /// Waves of a few cells that grow in steps of any length; nullopt where there are none. By steps from `shortest` to
  /// `longest`, as long as it takes to see the most of a run that takes `time`.
  std::optional<ShortWaves> short_waves(double shortest, double longest, double time) const;

  /// Whether weak growth is seen, by eigenvalues; else by what grows in some hundred steps alone.
  bool tells_eigenvalues() const { return tells_eigenvalues_; }

 private:
  /// What the equations make of disturbances.
  struct Reference {
    double step = 0;              // between two values
    std::vector<double> growths;  // ln of what they have grown by, events left out
    bool is_cut_off = false;      // then what is left of it goes on as its last half
    double length() const { return step * static_cast<double>(growths.size()); }
    double at(double time) const;
    double up_to(double time) const;
  };
  CoupledRuns(TangentRuns runs, std::function<std::optional<stencil::State>(double)> inputs_after,
              stencil::Params params, int steps, double own_step)
      : runs_(std::move(runs)),
        inputs_after_(std::move(inputs_after)),
        params_(std::move(params)),
        steps_(steps),
        own_step_(own_step) {}
  static constexpr int fewest_of_space = 8;
  static constexpr double least_told = 1e-9;  // ln |g|
  /// ln |g| of the largest eigenvalue that is found, and from where on that is surely one of the step.
  struct OfSpace {
    double growth = 0;
    double told = 0;
    bool is_told() const { return growth > told; }
  };
  bool grows_nothing_in(double step) const;
  stencil::Params params_of(double step) const;
  std::optional<OfSpace> growth_in(const KrylovSpace& space, Eigen::Index most) const;
  /// Of what steps make of a perturbation; 0 x 0 where that tells nothing.
  KrylovSpace space_of(const TangentRuns& runs, double step, const Eigen::MatrixXd& start) const;
  std::optional<OfSpace> growth_in_space(const TangentRuns& runs, double step, const Eigen::MatrixXd& start) const {
    return growth_in(space_of(runs, step, start), most_of_space(start));
  }
  /// ln of what the equations multiply by in a step, of what there is in the perturbation; nullopt: not known.
  std::optional<double> growth_by_right(double step, const Eigen::MatrixXd& perturbation) const;
  /// The same of a vector of the step, by its share of short steps: about the states of `runs`.
  std::optional<double> growth_of_vector(const TangentRuns& runs, double step, const Eigen::MatrixXd& vector) const;
  /// By short steps about the state in the middle of the step.
  std::optional<double> growth_midway(double step, const Eigen::MatrixXd& vector) const;
  int most_of_space(const Eigen::MatrixXd& start) const;
  /// The same beyond what events do, and twice what the equations do; 0 where either is not known.
  OfSpace eigenvalue_beyond_equations(double step, const Eigen::MatrixXd& perturbation) const;
  std::vector<double> growths_of_run(double step, int steps) const { return repeated(step, steps).growths; }
  /// \throws NoSolution where a solve fails in a step of the scene's length: so it does in the run, and that is no
  /// growth. In others growth is infinite then.
  TangentRuns::Repeated repeated(double step, int steps, double enough = std::numeric_limits<double>::infinity(),
                                 int kept_steps = 0) const;
  /// Along the axis where they are shortest, of the states that grow from what is kept of the run on; by `growth` in
  /// all.
  double cells_of_waves(const TangentRuns::Repeated& run, double growth) const;
  Reference reference(double step, double length) const;
  Reference reference_by_flow(double length) const;
  Reference reference_by_parts(double step, double length) const;
  /// ln of what the equations multiply by in this time.
  double growth_by_equations(double step, double length) const;

  TangentRuns runs_;
  std::function<std::optional<stencil::State>(double)> inputs_after_;  // a step of this length
  stencil::Params params_;
  int steps_;
  double own_step_;                   // the scene's, or that of its parts
  int parts_ = 4;                     // of a step: short ones
  bool tells_eigenvalues_ = true;     // not where products fold back: as waves spread these are none of the run
  std::vector<bool> are_rings_ = {};  // axes
  double by_events_ = 0;              // ln |g| in a step of length 0, where events end each step
  std::unique_ptr<CoupledFlow> flow_ = nullptr;  // null: short steps stand for it
  double rate_ = 0;                              // 1/time: what grows most in the flow
  mutable std::map<double, bool> are_stable_;    // steps that were asked about: searches come back to them, a cache
  mutable Eigen::MatrixXd grown_;                // in a step that was found to be too long; empty: none
  /// Of the last step with an eigenvalue that is told.
  struct Told {
    double step = 0, by_right = 0;  // ln of what the equations multiply by in it
    Eigen::MatrixXd vector;
  };
  mutable Told told_;
  mutable Reference reference_;  // of the longest run so far: a cache
};

}  // namespace dpde::stability
