// SPDX-License-Identifier: Apache-2.0
// What commands say about the growth of a gradient on its way back.
#pragma once

#include <string>
#include <vector>

#include "analysis/gradient_growth.h"
#include "task_run.h"

namespace dpde::tools {

/// A warning where the gradient has lost its digits, and why; null or what --json says of it.
Json report_growth(Job& job, const TaskRun& run, const std::vector<analysis::AdjointWatch::Look>& looks,
                   const Eigen::VectorXd& x, const Eigen::VectorXd& gradient);

/// For a gradient that is not finite: that its adjoint has grown beyond all numbers; "" where it has not, and where it
/// is the run that leaves all bounds. The session's run is another one afterwards.
std::string help_for_growth(const TaskRun& run, const std::vector<analysis::AdjointWatch::Look>& looks);

}  // namespace dpde::tools
