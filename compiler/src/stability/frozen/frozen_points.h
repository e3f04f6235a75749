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

/// The points at which the fields that the tangent reads are smallest and largest, some between, and those with the
/// smallest cells; also at other times if the step varies in time. Equal points are listed once; one point if nothing
/// varies. Only a few of them if an analysis of waves takes long.
std::vector<ScenePoint> frozen_points(driver::Session& session, const LinearStep& linear);
/// `others` are the points left out. One check of each at the limit of the chosen points shows whether it has a lower
/// limit.
struct RankedPoints {
  std::vector<ScenePoint> chosen, others;
};
RankedPoints ranked_points(driver::Session& session, const LinearStep& linear);
/// All points, for cheap checks.
std::vector<ScenePoint> all_frozen_points(driver::Session& session, const LinearStep& linear);

/// The points at which a solution of a solve is steepest along an axis: there the wind of a stream function is fastest.
std::vector<ScenePoint> steepest_points(driver::Session& session, const LinearStep& linear);

/// The fields of the point that the response depends on.
std::set<std::string> fields_of_response(const LinearStep& linear, const FrozenPoint& point, double step);

/// Whether the response is the same at all points, states and times: the analysis of one then holds for all.
bool is_same_everywhere(driver::Session& session, const LinearStep& linear, const FrozenPoint& point);

/// Whether a step late in the run differs from the first step.
bool varies_in_time(driver::Session& session);

}  // namespace dpde::stability
