// SPDX-License-Identifier: Apache-2.0
// Growth rates between walls of a step with coefficients frozen at one point.
#pragma once

#include "stability/frozen/frozen_points.h"
#include "stability/waves/wall_spectrum.h"

namespace dpde::stability {

class WallRates {
 public:
  /// `without_events`: the step without its events; null if it has none.
  WallRates(const LinearStep& linear, const LinearStep* without_events, const std::vector<model::Axis>& axes)
      : all_(linear, axes),
        plain_(without_events == nullptr ? linear : *without_events, axes),
        has_events_(without_events != nullptr) {}

  /// The largest ln |g| / step; 0 if nothing grows.
  double rate(const ScenePoint& at, double step) const;
  /// The growth rate of the equations, from factors of a short step near 1. Multistep schemes have parasitic factors
  /// elsewhere, which walls may make grow at every step.
  double own_rate(const ScenePoint& at, double short_step) const;
  /// ln |g| in a step of length 0.
  double growth_by_events(const ScenePoint& at) const;

 private:
  WallSpectrum all_, plain_;  // plain_: without events
  bool has_events_;
};

}  // namespace dpde::stability
