// SPDX-License-Identifier: Apache-2.0
// A step on the scene's own grid, as a matrix: of steps that depend neither on their states nor on time, where there
// are few cells. It sees walls, spacings and coefficients as they are, all at once. Nothing is frozen.
//
// With g = exp(-2 s dt) G / e, where G is the matrix of a step dt, s the growth rate of the equations and e what events
// that end each step multiply at most, a step is stable where none of these holds:
//   - a power of g beyond the 512th grows faster than in proportion: |g^262144| > 10 * 512 * max |g^n|, n up to 512.
//     Growth in proportion is that of means that drift by right.
//   - more of its eigenvalues are above 1 than the equations have rates that do not decay, where one of these grows.
//   - the first powers are more than a hundred times as large as those of steps of an eighth in the same time.
//     Eigenvalues alone would call stable what grows while it is carried through the domain and dies at its end (L. N.
//     Trefethen and M. Embree, Spectra and Pseudospectra, 2005, chapter 14).
// Powers tell no growth below `least_growth`. The largest eigenvalue does, where rounding moves it less than that.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "driver/scene/session.h"
#include "stability/equations.h"
#include "stability/step/linear_step.h"
#include "stencil/interpret/interpret.h"

namespace dpde::stability {

class OwnGrid {
 public:
  static constexpr double least_growth = 3e-5;  // ln |g| that powers tell

  /// `point` is any of the scene's. nullopt for steps of other kinds, and for grids that are too large.
  static std::optional<OwnGrid> make(driver::Session& session, const LinearStep& linear, const FrozenPoint& point,
                                     double step, const Equations& equations);

  /// The largest real part of the equations' own eigenvalues, 1/time; 0 where none is positive.
  double growth_rate() const { return rate_; }
  /// The largest of these eigenvalues, 1/time; 0 where nothing moves.
  double fastest() const { return fastest_; }
  bool is_stable(double step) const;
  /// ln |g| of the largest eigenvalue; 0 where rounding may have made it.
  double sure_growth(double step) const;
  /// |g| of what grows most in the long run, or on the way.
  double growth(double step) const;
  /// ln |g| of what the events that end each step let grow most.
  double growth_by_events() const { return by_events_; }

 private:
  OwnGrid(driver::Session& session, const LinearStep& linear, const FrozenPoint& point);
  void measure_rates(double step);
  /// ln of what is allowed to grow in a step: twice the equations' growth, and that of events.
  double allowed(double step) const { return 2 * rate_ * step + by_events_; }
  double rate_of_powers(double step) const;
  /// So short that a step of it changes little; 0 where none does, as of schemes with a memory.
  bool grows_in_no_time() const;
  static Eigen::Index surely_growing(const Eigen::MatrixXd& g);
  double smooth_length(double step) const;
  double largest_of_parts(double step) const;
  Eigen::MatrixXd tangent(double step) const;
  /// One run for all cells of a group. nullopt where two of them reach one cell all the same.
  std::optional<Eigen::MatrixXd> tangent_by_colours(double step) const;
  /// How far a perturbation reaches in a step along each axis; all of the grid where that is not known.
  stencil::CellIndex reach(double step) const;
  /// The step of perturbations, all states one behind the other.
  Eigen::VectorXd applied(const Eigen::VectorXd& perturbations, double step) const;
  Eigen::Index cells() const;

  const LinearStep& linear_;
  FrozenPoint point_;
  std::vector<std::size_t> active_;  // states that anything depends on
  std::vector<Topology> topologies_;
  stencil::Params params_;
  stencil::State memory_;
  double rate_ = 0, fastest_ = 0, by_events_ = 0;
  Eigen::Index growing_ = 0;  // rates that do not decay; 0 where something grows by right and they are not known
};

}  // namespace dpde::stability
