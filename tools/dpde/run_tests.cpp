// SPDX-License-Identifier: Apache-2.0
// Runs and reports the tests of a task that learns.
#include <fmt/format.h>

#include "report/training/tests.h"
#include "report/training/training_chart.h"
#include "scene_output.h"
#include "train.h"

namespace dpde::tools {

void run_tests(Job& job, const training::TestRun& run, const training::TestedValues& values,
               const std::string& if_stopped, Json& json) {
  if (run.scenes.tests.empty() && run.scenes.growths.empty()) return;
  job.say(report::weights_not_used_text(run.scenes));
  const std::optional<training::AllTests> all = training::run_tests(run, values, job.sink());
  if (!all) {
    job.sink().report("run-failed", {}, {"stopped before all tests were run"}, if_stopped);
    return;
  }
  for (std::size_t k = 0; run.chart && k < all->left_out.size(); ++k)
    job.say(fmt::format("left out: {}\n", all->left_out[k]));
  report::Report report = report::tests_report(all->tests);
  report.append(report::growths_report(all->growths));
  if (all->has_plain_methods) report.append(report::training_chart(run.scenes, all->tests));
  json.update(report.json);
  tell(job, report);
  if (!job.failed()) training::report_nothing_finite(run.scenes, all->tests.trials[all->tests.best], job.sink());
}

}  // namespace dpde::tools
