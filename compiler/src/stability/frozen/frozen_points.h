// SPDX-License-Identifier: Apache-2.0
// Points of a scene at which its coefficients and its initial state are frozen for an analysis of waves.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stability/step/linear_step.h"

namespace dpde::stability {

struct ScenePoint {
  FrozenPoint point;
  std::string place;  // "x = 0.1, y = 0.2"; "" where all points are alike
};

/// Where the fields that the tangent reads are smallest and largest, some places between, and where cells are smallest;
/// at other times too where that matters. Each different one once, one where nothing varies. A few of them where an
/// analysis of waves takes long.
std::vector<ScenePoint> frozen_points(driver::Session& session, const LinearStep& linear);
/// With those that are left out: one look at each, at the limit of the chosen ones, tells whether it has a lower one.
struct RankedPoints {
  std::vector<ScenePoint> chosen, others;
};
RankedPoints ranked_points(driver::Session& session, const LinearStep& linear);
/// All of them, for what takes no longer than a look.
std::vector<ScenePoint> all_frozen_points(driver::Session& session, const LinearStep& linear);

/// Where what is solved for is steepest along an axis: there the wind of a stream function is fastest.
std::vector<ScenePoint> steepest_points(driver::Session& session, const LinearStep& linear);

/// Fields of the point without which there is no response.
std::set<std::string> fields_of_response(const LinearStep& linear, const FrozenPoint& point, double step);

/// Whether a step from all places, states and times has this response: the analysis of one holds for all.
bool is_same_everywhere(driver::Session& session, const LinearStep& linear, const FrozenPoint& point);

/// Whether a step late in the run is another than one that begins it.
bool varies_in_time(driver::Session& session);

}  // namespace dpde::stability
