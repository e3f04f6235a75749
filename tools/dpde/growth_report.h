// SPDX-License-Identifier: Apache-2.0
// What commands say about the growth of a gradient on its way back.
#pragma once

#include "analysis/gradient_growth.h"
#include "task_run.h"

namespace dpde::tools {

/// A warning where the gradient has lost its digits, and why; null or what --json says of it.
Json report_growth(Job& job, const TaskRun& run, const std::vector<analysis::AdjointWatch::Look>& looks);

}  // namespace dpde::tools
