// SPDX-License-Identifier: Apache-2.0
// The integral of a field over its run, and how far it drifts: what a flow should conserve, or by how much walls and
// sources change it.
#pragma once

#include <vector>

namespace dpde::analysis {

/// Of a field's frames in a run.
struct Integrals {
  std::vector<double> values;  // one a frame
  double magnitude = 0;        // mean over the frames of the integral of |u|

  /// `volumes`: of the cells.
  void add(const std::vector<double>& frame, const std::vector<double>& volumes);
  /// Largest distance from the first frame's, and that in parts of the magnitude; both 0 of a field that is 0.
  double drift() const;
  double relative_drift() const;
};

}  // namespace dpde::analysis
