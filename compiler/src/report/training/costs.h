// SPDX-License-Identifier: Apache-2.0
// Report of a scene's costs before it runs: bytes and flops of a step, memory, and savings.
#pragma once

#include <cstdint>
#include <string>

#include "driver/compile/pipeline.h"
#include "report/report.h"

namespace dpde::report {

/// Number of weights and multiplications of each network.
Report networks_report(const model::Problem& problem);
/// For a step with `cells` cells, and the machine's limit, measured in an undisturbed moment.
Report cost_report(const driver::Compiled& compiled, double cells, int threads, bool measures_again);
/// Transforms and solves of a step act on the whole grid; the bytes of transforms are included in those of a run.
Report whole_grid_report(const driver::Compiled& compiled);

struct GradientLimits {
  int threads = 1;
  std::int64_t checkpoint_bytes = 0;
  std::string checkpoint_folder;  // "": in memory
};
/// The states that a gradient stores, by the plan of the run itself; follows the memory of a run.
Report gradient_memory_report(const driver::Compiled& compiled, const SourceFile& source, const GradientLimits& limits);
/// Savings from dropping terms and derivatives that are not needed, compared with the full scene.
Report savings_report(const driver::Compiled& compiled, const SourceFile& source);

}  // namespace dpde::report
