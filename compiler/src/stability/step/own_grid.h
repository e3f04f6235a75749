// SPDX-License-Identifier: Apache-2.0
// The matrix of a step on the scene's own grid, with its walls, spacings and coefficients; nothing is frozen. Only for
// linear steps with constant coefficients in time, and few cells.
//
// With g = exp(-2 s dt) G / e, where G is the matrix of a step dt, s the growth rate of the equations and e the largest
// factor of the events that end each step, a step is stable if none of these holds:
//   - powers of g beyond the 512th grow faster than linearly: |g^262144| > 10 * 512 * max |g^n|, n up to 512. Linear
//     growth is allowed: means may drift physically.
//   - some rate of the equations grows, and more eigenvalues of G are above 1 than the equations have rates that do not
//     decay.
//   - the first powers are more than a hundred times as large as those of steps of an eighth in the same time.
//     Eigenvalues alone miss disturbances that grow while they are carried through the domain and vanish at its end
//     (L. N. Trefethen and M. Embree, Spectra and Pseudospectra, 2005, chapter 14).
// Powers do not show growth below `least_growth`. The largest eigenvalue does if rounding moves it by less.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "driver/scene/session.h"
#include "stability/equations.h"
#include "stability/step/linear_step.h"
#include "stencil/interpret/interpret.h"

namespace dpde::stability {

/// Whether steps depend neither on their states nor on time, other than by formulas that read it.
bool is_linear(driver::Session& session, const LinearStep& linear);
/// The same, and whether no formula reads the time.
bool is_linear_and_steady(driver::Session& session, const LinearStep& linear);

class OwnGrid {
 public:
  static constexpr double least_growth = 3e-5;  // least ln |g| that powers show

  /// `point` is any point of the scene. nullopt for other kinds of steps, and for grids that are too large.
  static std::optional<OwnGrid> make(driver::Session& session, const LinearStep& linear, const FrozenPoint& point,
                                     double step, const Equations& equations);

  /// The largest real part of the equations' own eigenvalues, 1/time; 0 where none is positive.
  double growth_rate() const { return rate_; }
  /// The largest magnitude of these eigenvalues, 1/time; 0 if nothing changes.
  double fastest() const { return fastest_; }
  bool is_stable(double step) const;
  /// ln |g| of the largest eigenvalue; 0 if it may be rounding.
  double sure_growth(double step) const;
  /// The largest growth factor |g| per step, asymptotic or transient.
  double growth(double step) const;
  /// ln of the largest factor of the events that end each step.
  double growth_by_events() const { return by_events_; }
  /// ln of the allowed growth in a step: twice that of the equations, and that of events.
  double allowed(double step) const { return 2 * rate_ * step + by_events_; }
  const FrozenPoint& point() const { return point_; }
  bool is_semi_lagrangian() const { return linear_.is_semi_lagrangian(); }

 private:
  OwnGrid(driver::Session& session, const LinearStep& linear, const FrozenPoint& point);
  void measure_rates(double step);
  double rate_of_powers(double step) const;
  bool grows_in_no_time() const;
  /// A length so short that a step of it changes little; 0 if there is none, as with multistep schemes.
  double smooth_length(double step) const;
  double largest_of_parts(double step, double enough) const;
  Eigen::MatrixXd tangent(double step) const;
  /// By one run per group of cells that share no result cell (colouring); nullopt if two cells of a group do share one.
  std::optional<Eigen::MatrixXd> tangent_by_colours(double step) const;
  /// The stencil radius of a step along each axis; the whole grid if it is not known.
  stencil::CellIndex reach(double step) const;
  /// The step applied to perturbations, all states one after the other.
  Eigen::VectorXd applied(const Eigen::VectorXd& perturbations, double step) const;
  Eigen::Index cells() const;

  const LinearStep& linear_;
  FrozenPoint point_;
  std::vector<std::size_t> active_;  // states that the step depends on
  std::vector<Topology> topologies_;
  stencil::Params params_;
  stencil::State memory_;
  double rate_ = 0, fastest_ = 0, by_events_ = 0;
  Eigen::Index growing_ = 0;  // rates that do not decay; 0 if there is physical growth and they are not known
};

}  // namespace dpde::stability
