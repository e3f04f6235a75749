// SPDX-License-Identifier: Apache-2.0
// Integral of a field over a run and its drift: what should be conserved, or the net effect of walls and sources.
#pragma once

#include <vector>

namespace dpde::analysis {

/// Integrals of the frames of a field in a run.
struct Integrals {
  std::vector<double> values;  // one for each frame
  double magnitude = 0;        // mean over the frames of the integral of |u|

  /// `volumes`: cell volumes.
  void add(const std::vector<double>& frame, const std::vector<double>& volumes);
  /// Largest distance from the first frame's integral, absolute or relative to the magnitude; 0 for a field that is 0.
  double drift() const;
  double relative_drift() const;
};

}  // namespace dpde::analysis
