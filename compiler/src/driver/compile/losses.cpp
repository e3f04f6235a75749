// SPDX-License-Identifier: Apache-2.0
#include "driver/compile/losses.h"

#include <fmt/format.h>

namespace dpde::driver {

const model::Optimiser* newton_of(const Compiled& compiled) {
  const bool has_task = compiled.problem && compiled.problem->task && compiled.problem->task->optimiser;
  const model::Optimiser* optimiser = has_task ? &*compiled.problem->task->optimiser : nullptr;
  return optimiser != nullptr && optimiser->kind == model::Optimiser::Kind::newton_cg ? optimiser : nullptr;
}

void check_losses(const Compiled& compiled, DiagnosticSink& sink) {
  if (!compiled.problem || !compiled.problem->task) return;
  const model::Task& task = *compiled.problem->task;
  const model::Optimiser* newton = newton_of(compiled);
  for (std::size_t i = 0; i < task.losses.size(); ++i) {
    const SourceRange range = task.losses[i].origin.range;
    const auto loss = compiled.derived.find(compiled.names.losses[i]);
    if (newton != nullptr && task.losses[i].of_averages) {
      sink.report("not-allowed-here", range, {"average", "a task that is solved by newton_cg"},
                  "it has no second derivatives: write using lbfgs(), or adam(rate = 1e-3)");
    } else if (loss == compiled.derived.end() && !task.losses[i].average.empty()) {
      continue;  // depends on data only
    } else if (loss == compiled.derived.end()) {
      sink.report("no-useful-derivative", range, {fmt::format("loss {} of task", i + 1), task.name},
                  "it depends on no state and on no unknown: leave it out, or write it as a test");
    } else if (newton != nullptr && newton->gauss_newton && !loss->second.gauss_newton_adjoint) {
      sink.report("not-squares", range, {},
                  "write sums of squares, as in mean((u - v)^2) + 1e-3*mean(dx(k)^2), or newton_cg(hessian = full)");
    }
  }
}

}  // namespace dpde::driver
