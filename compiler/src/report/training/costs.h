// SPDX-License-Identifier: Apache-2.0
// What is said of what a scene costs before it runs: bytes and flops of a step, memory, and what is saved.
#pragma once

#include <cstdint>
#include <string>

#include "driver/compile/pipeline.h"
#include "report/report.h"

namespace dpde::report {

/// Weights and multiplications of each network.
Report networks_report(const model::Problem& problem);
/// Of a step of so many cells, and what the machine allows, as it was measured in an undisturbed moment.
Report cost_report(const driver::Compiled& compiled, double cells, int threads, bool measures_again);
/// Transforms and solves of a step go over the whole grid; the bytes of the first are in those of a run.
Report whole_grid_report(const driver::Compiled& compiled);

struct GradientLimits {
  int threads = 1;
  std::int64_t checkpoint_bytes = 0;
  std::string checkpoint_folder;  // "": they are in memory
};
/// The states that a gradient stores, by the plan of the run itself: what stands behind the memory of a run.
Report gradient_memory_report(const driver::Compiled& compiled, const SourceFile& source, const GradientLimits& limits);
/// What dropping terms and leaving out derivatives that nobody asks for saves, against the scene with all of them.
Report savings_report(const driver::Compiled& compiled, const SourceFile& source);

}  // namespace dpde::report
