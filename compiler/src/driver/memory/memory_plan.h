// SPDX-License-Identifier: Apache-2.0
// Predicts the peak memory of a run or a gradient. The engine and its rollouts count what they would allocate
// (driver/memory/dry_engine.h); arrays of a session are added here. Code, libraries and the compiler itself are not
// included.
#pragma once

#include <map>
#include <optional>
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

/// For `dpde gradient`, with the runs of scenes that make its data; nullopt if the step or a loss has no adjoint.
/// @throws Error(input) if the budget is too small for any gradient.
std::optional<MemoryPlan> plan_of_gradient_memory(const Compiled& compiled, const StorageOptions& options,
                                                  const SourceFile& source);

/// Whether a run fits into the available memory; reports an error if not. Asking for more would kill the process
/// silently.
bool run_fits(const Compiled& compiled, const SourceFile& source, DiagnosticSink& sink);

/// The same for a gradient of the task; also reports an error if its states do not fit the budget.
bool gradient_fits(const Compiled& compiled, const StorageOptions& options, const SourceFile& source,
                   DiagnosticSink& sink);

}  // namespace dpde::driver
