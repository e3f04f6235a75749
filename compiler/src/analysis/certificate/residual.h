// SPDX-License-Identifier: Apache-2.0
// How well stored frames satisfy a scene: its own discrete steps from one frame should lead to the next. They do to the
// last bit where the frames are the scene's own; what down-sampling has taken away shows as a residual.
#pragma once

#include <atomic>
#include <limits>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::analysis {

/// Of a state in a run, over cells and the intervals that are looked at; not numbers where that is not known.
struct Residual {
  double rate = std::numeric_limits<double>::quiet_NaN();  // root of the mean square of what the steps miss the next
                                                           // frame by, in a unit of time
  double relative = std::numeric_limits<double>::quiet_NaN();  // in parts of the change from frame to frame; 0 where
                                                               // nothing is missed
};

/// Frames at steps `first`, `first + every`, ... of a run.
struct StoredFrames {
  const std::vector<std::vector<double>>& states;  // of each state of the session's rollout, one frame after the other
  int first = 0, every = 1, count = 0;
};

/// Of each state, from at most `most` intervals at equal distances. The session is on the grid of the frames, its
/// option `stop` is `stop`, which is false afterwards unless it becomes true from outside. Infinite where the steps
/// blow up.
std::vector<Residual> residuals_of(driver::Session& session, std::atomic<bool>& stop, const StoredFrames& frames,
                                   int most);

}  // namespace dpde::analysis
