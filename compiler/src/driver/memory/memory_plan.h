// SPDX-License-Identifier: Apache-2.0
// What a run or a gradient takes of memory at its peak, before it runs: fields as a session makes and drops them, one
// step after the other, what the runtime counts of a rollout (driver/memory/storage.h), and what programs hold beside
// their fields, as they say themselves (Executor::memory). Code, libraries and the compiler itself come on top.
#pragma once

#include <map>
#include <string>

#include "driver/memory/storage.h"

namespace dpde::driver {

struct MemoryPlan {
  double peak = 0;                       // bytes
  std::map<std::string, double> shares;  // of it, by owner
};

/// Of `dpde run` without --out.
MemoryPlan plan_of_run(const Compiled& compiled);
double peak_of_run(const Compiled& compiled);

/// What `dpde run --out` takes more: all states of its outputs, as they are kept until the file is written.
double bytes_of_outputs(const Compiled& compiled);

/// Of `dpde gradient`, with the runs of scenes that make its data; `plan` is that of plan_of_gradient().
MemoryPlan plan_of_gradient_memory(const Compiled& compiled, const GradientPlan& plan, const SourceFile& source);
double peak_of_gradient(const Compiled& compiled, const GradientPlan& plan, const SourceFile& source);

/// Whether it fits into the memory that is there, else an error: asking for more would end the process without a word.
bool run_fits(const Compiled& compiled, const SourceFile& source, DiagnosticSink& sink);

/// The same of a gradient of the task, and an error too where its states do not fit the budget.
bool gradient_fits(const Compiled& compiled, const StorageOptions& options, const SourceFile& source,
                   DiagnosticSink& sink);

}  // namespace dpde::driver
