// SPDX-License-Identifier: Apache-2.0
// Predicts the peak memory of a run or a gradient. Counts fields as a session creates and drops them, the runtime's
// count for a rollout (driver/memory/storage.h), and the programs' memory other than fields, as they report it
// (Executor::memory). Code, libraries and the compiler itself are not included.
#pragma once

#include <map>
#include <string>

#include "driver/memory/storage.h"

namespace dpde::driver {

struct MemoryPlan {
  double peak = 0;                       // bytes
  std::map<std::string, double> shares;  // parts of the peak, by owner
};

/// For `dpde run` without --out.
MemoryPlan plan_of_run(const Compiled& compiled);
double peak_of_run(const Compiled& compiled);

/// Additional bytes of `dpde run --out`: all states of its outputs, stored until the file is written.
double bytes_of_outputs(const Compiled& compiled);

/// For `dpde gradient`, with the runs of scenes that make its data; `plan` is the result of plan_of_gradient().
MemoryPlan plan_of_gradient_memory(const Compiled& compiled, const GradientPlan& plan, const SourceFile& source);
double peak_of_gradient(const Compiled& compiled, const GradientPlan& plan, const SourceFile& source);

/// Whether a run fits into the available memory; reports an error if not. Asking for more would kill the process
/// silently.
bool run_fits(const Compiled& compiled, const SourceFile& source, DiagnosticSink& sink);

/// The same for a gradient of the task; also reports an error if its states do not fit the budget.
bool gradient_fits(const Compiled& compiled, const StorageOptions& options, const SourceFile& source,
                   DiagnosticSink& sink);

}  // namespace dpde::driver
