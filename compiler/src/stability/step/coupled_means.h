// SPDX-License-Identifier: Apache-2.0
// Means and sums of perturbations weighted by other fields, as the mean of u^2 with the tangent mean(2 u u'). They
// couple each cell to all others with different weights, so no Fourier mode at a frozen point represents them. The same
// holds for plain means that act differently at different points, as inside a mask. The analysis of waves leaves these
// means out; runs of the step's tangent about the initial state on the scene's own grid contain them. Such runs also
// contain the effects of curved coordinates, which frozen coefficients miss: cells that narrow towards a pole, and the
// connection across it.
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

/// The module with 0 instead of these means, in its first program. `rates`: fields of perturbations.
stencil::Module without_coupled_means(stencil::Module module, const std::set<std::string>& rates);

/// The same with 0 instead of all means and sums of perturbations.
stencil::Module without_means(stencil::Module module, const std::set<std::string>& rates);

/// The step with all means left to runs, if their effect differs between points or times and runs are possible. The
/// mean over the grid is then no Fourier mode: its factor at one point, as inside a mask, would be that of a grid which
/// is like that point everywhere.
LinearStep with_means_of_runs(driver::Session& session, const LinearStep& linear, double step);

/// The worst point, at its time and at a few other times of `points`: moving fields, as a mask, are frozen in a run.
std::vector<FrozenPoint> moments_of(const FrozenPoint& worst, const std::vector<ScenePoint>& points);

/// Waves of so few cells that the differences do not resolve them. They grow in steps of any length.
struct ShortWaves {
  double rate = 0;   // growth rate, 1/time
  double cells = 0;  // wavelength in cells
};

class CoupledRuns {
 public:
  /// null if the step's tangent cannot be compiled. `euler`: an Euler step of the same equations, for their own growth;
  /// if it is null or gives no CoupledFlow, short steps of the scheme give that growth. `own_step`: the length of the
  /// scene's step or substep.
  static std::unique_ptr<CoupledRuns> make(driver::Session& session, const LinearStep& linear, const FrozenPoint& point,
                                           bool has_events, double own_step, const LinearStep* euler = nullptr);

  /// Whether the step has such means, curved coordinates, or aliasing products (folded_products.h).
  static bool are_needed(driver::Session& session, const LinearStep& linear);
  /// Whether the grid has so few cells that all runs have the most steps.
  static bool are_long(driver::Session& session, const LinearStep& linear);
  /// Whether only aliasing products need runs, and the cells are so many that runs take more than some seconds. No
  /// shorter check finds such limits, and the scene's own run shows this growth as early.
  static bool are_too_long(driver::Session& session, const LinearStep& linear);

  /// Whether random disturbances grow by at most a factor of 100 beyond the allowed growth (that of events, and twice
  /// that of the equations in the same time), and no eigenvalue found exceeds the allowed growth at all. Eigenvalues
  /// show growth that a few steps do not. The vector that grew in a longer, unstable step is checked, too: near its
  /// limit a few steps do not separate it from noise.
  bool is_stable(double step) const;
  /// The step at which the growing vector of an unstable step begins to exceed the allowed growth, to the relative
  /// `precision`. It is a guess of the limit, as other vectors may grow in shorter steps. 0: none.
  double begins_to_grow(double unstable, double precision) const;
  /// ln |g| of the fastest growing disturbance.
  double growth(double step) const;
  /// The exponent if growth above `limit` rises as a power of the step, so that `limit` is only where growth becomes
  /// visible; else 0.
  double power_of_growth(double limit) const;
  /// The power of the step with which growth beyond that of the equations rises near this step; 0: not known.
  double order_of_growth(double step) const;
  /// The step at which the search begins: it resolves every rate of the equations; 0 if these are not known.
  double surely_short() const { return flow_ ? 0.25 * flow_->step() : 0; }
  /// The growth rate, 1/time, if a disturbance grows more than a hundredfold in short steps; else 0.
  double growth_rate(double step) const;
  /// The growth rate, 1/time, over the second half of a run of short steps.
  double late_growth_rate(double step) const;
  double growth_by_events() const { return by_events_; }
  /// Waves of a few cells that grow in steps of any length; nullopt if there are none. The steps are between `shortest`
  /// and `longest`, so that an affordable number of them covers as much as possible of a run of length `time`.
  std::optional<ShortWaves> short_waves(double shortest, double longest, double time) const;

  /// Whether eigenvalues show weak growth; else only growth over some hundred steps is seen.
  bool tells_eigenvalues() const { return tells_eigenvalues_; }

 private:
  /// The growth of disturbances by the equations.
  struct Reference {
    double step = 0;              // time between two values
    std::vector<double> growths;  // ln of the growth so far, without events
    bool is_cut_off = false;      // ended early: extrapolated by the growth of its last half
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
  /// ln |g| of the largest Ritz value, and the threshold above which it is surely an eigenvalue of the step.
  struct OfSpace {
    double growth = 0;
    double told = 0;
    bool is_told() const { return growth > told; }
  };
  bool grows_nothing_in(double step) const;
  stencil::Params params_of(double step) const;
  std::optional<OfSpace> growth_in(const KrylovSpace& space, Eigen::Index most) const;
  /// The Krylov space of a perturbation; 0 x 0 if it gives no result.
  KrylovSpace space_of(const TangentRuns& runs, double step, const Eigen::MatrixXd& start) const;
  std::optional<OfSpace> growth_in_space(const TangentRuns& runs, double step, const Eigen::MatrixXd& start) const {
    return growth_in(space_of(runs, step, start), most_of_space(start));
  }
  /// ln of the physical growth in a step, on the Krylov space of the perturbation; nullopt: not known.
  std::optional<double> growth_by_right(double step, const Eigen::MatrixXd& perturbation) const;
  /// The same for an eigenvector of the step, by short steps about the states of `runs`.
  std::optional<double> growth_of_vector(const TangentRuns& runs, double step, const Eigen::MatrixXd& vector) const;
  /// The same by short steps about the state in the middle of the step.
  std::optional<double> growth_midway(double step, const Eigen::MatrixXd& vector) const;
  int most_of_space(const Eigen::MatrixXd& start) const;
  /// ln |g| of the largest eigenvalue minus the allowed growth (events, twice the equations); 0 if either is not known.
  OfSpace eigenvalue_beyond_equations(double step, const Eigen::MatrixXd& perturbation) const;
  std::vector<double> growths_of_run(double step, int steps) const { return repeated(step, steps).growths; }
  /// \throws NoSolution if a solve fails in a step of the scene's length: it fails in the run, too, which is no
  /// growth. In steps of other lengths a failed solve counts as infinite growth.
  TangentRuns::Repeated repeated(double step, int steps, double enough = std::numeric_limits<double>::infinity(),
                                 int kept_steps = 0) const;
  /// The wavelength in cells, along the axis where it is shortest, of the states that grow from `run.kept` to
  /// `run.last`; `growth` is the ln of the total growth.
  double cells_of_waves(const TangentRuns::Repeated& run, double growth) const;
  Reference reference(double step, double length) const;
  Reference reference_by_flow(double length) const;
  Reference reference_by_parts(double step, double length) const;
  /// ln of the growth by the equations in this time.
  double growth_by_equations(double step, double length) const;

  TangentRuns runs_;
  std::function<std::optional<stencil::State>(double)> inputs_after_;  // a step of this length
  stencil::Params params_;
  int steps_;
  double own_step_;                   // length of the scene's step or substep
  int parts_ = 4;                     // a short step is the step divided by this
  bool tells_eigenvalues_ = true;     // false with aliasing products: as waves spread, eigenvalues are not the run's
  std::vector<bool> are_rings_ = {};  // axes
  double by_events_ = 0;              // ln |g| in a step of length 0, where events end each step
  std::unique_ptr<CoupledFlow> flow_ = nullptr;  // null: short steps are used instead
  double rate_ = 0;                              // 1/time: the largest growth rate of the flow
  mutable std::map<double, bool> are_stable_;    // results by step: a cache, as searches return to steps
  mutable Eigen::MatrixXd grown_;                // the growing vector of an unstable step; empty: none
  /// The last step with a sure eigenvalue, and its vector.
  struct Told {
    double step = 0, by_right = 0;  // by_right: ln of the physical growth in the step
    Eigen::MatrixXd vector;
  };
  mutable Told told_;
  mutable Reference reference_;  // of the longest run so far: a cache
};

}  // namespace dpde::stability
