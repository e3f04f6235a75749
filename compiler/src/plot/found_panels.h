// SPDX-License-Identifier: Apache-2.0
// Results of an optimisation as panels of a picture.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "driver/compile/pipeline.h"
#include "driver/scene/inverse.h"
#include "plot/scene_panels.h"

namespace dpde::plot {

struct Found {
  driver::Session& session;
  driver::Inverse& inverse;
  const driver::Compiled& compiled;

  const model::Task& task() const { return *session.problem().task; }
};

/// Target and result of each datum at the last time of the last loss, from one more run; then the controls and fields
/// found, compared with the scene's values. `x`: all unknowns.
std::vector<Panel> panels_of_found(const Found& found, const Eigen::VectorXd& x);
/// Beginnings of a control's intervals, and the end of the last one.
std::vector<double> intervals_of(const driver::Session& session, const std::string& control);

}  // namespace dpde::plot
