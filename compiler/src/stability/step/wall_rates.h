// SPDX-License-Identifier: Apache-2.0
// How fast grows what lies between walls, of a step whose coefficients are those of one point.
#pragma once

#include "stability/frozen/frozen_points.h"
#include "stability/waves/wall_spectrum.h"

namespace dpde::stability {

class WallRates {
 public:
  /// `without_events`: the step without them; null where it has none.
  WallRates(const LinearStep& linear, const LinearStep* without_events, const std::vector<model::Axis>& axes)
      : all_(linear, axes),
        plain_(without_events == nullptr ? linear : *without_events, axes),
        has_events_(without_events != nullptr) {}

  /// ln |g| / step of what grows most; 0 where nothing does.
  double rate(const ScenePoint& at, double step) const;
  /// Of the equations' own, those that a short step leaves near 1: schemes with a memory have others, which walls may
  /// let grow at every step.
  double own_rate(const ScenePoint& at, double short_step) const;
  /// ln |g| in a step of length 0.
  double growth_by_events(const ScenePoint& at) const;

 private:
  WallSpectrum all_, plain_;  // the second without events
  bool has_events_;
};

}  // namespace dpde::stability
