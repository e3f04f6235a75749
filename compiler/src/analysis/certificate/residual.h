// SPDX-License-Identifier: Apache-2.0
// How well stored frames satisfy a scene: the scene's discrete steps from one frame should lead to the next. For the
// scene's own frames they do to the last bit; down-sampling shows as a residual.
#pragma once

#include <atomic>
#include <limits>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::analysis {

/// For one state of a run, over cells and the sampled intervals; NaN if unknown.
struct Residual {
  double rate = std::numeric_limits<double>::quiet_NaN();      // RMS difference from the next frame per unit of time
  double relative = std::numeric_limits<double>::quiet_NaN();  // relative to the change between frames; 0 if equal
};

/// Frames at steps `first`, `first + every`, ... of a run.
struct StoredFrames {
  const std::vector<std::vector<double>>& states;  // for each state of the session's rollout, frame after frame
  int first = 0, every = 1, count = 0;
};

/// Residual of each state, from at most `most` equidistant intervals. The session must be on the grid of the frames and
/// have `stop` as its stop flag. The flag is false afterwards, unless set from outside. Infinite if the steps blow up.
std::vector<Residual> residuals_of(driver::Session& session, std::atomic<bool>& stop, const StoredFrames& frames,
                                   int most);

}  // namespace dpde::analysis
