// SPDX-License-Identifier: Apache-2.0
#include "report/training/one_test.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "support/maths/evaluate.h"
#include "support/names/number_text.h"

namespace dpde::report {

using training::mean_and_spread;
using training::MeanAndSpread;
using training::TrajectoryTest;

std::string text_of(const MeanAndSpread& value) {
  if (std::isnan(value.spread)) return fmt::format("{:.6g}", shown(value.mean));
  return fmt::format("{:.6g} +- {:.2g}", shown(value.mean), shown(value.spread));
}

std::string counted_runs(std::size_t runs) { return fmt::format("{} run{}", runs, runs == 1 ? "" : "s"); }

Json spread_json(double spread) { return std::isnan(spread) ? Json(nullptr) : json_number(spread); }

Json json_of(const std::vector<double>& values) {
  const MeanAndSpread all = mean_and_spread(values);
  return {{"mean", json_number(all.mean)}, {"spread", spread_json(all.spread)}, {"runs", json_numbers(values)}};
}

void say_solves(Report& report, const TrajectoryTest& test) {
  for (const driver::SolveReport& solve : test.solves) {
    const auto solves = static_cast<double>(solve.note.solves);
    const bool by_steps = solve.note.iterations > 0;
    const std::string iterations =
        by_steps ? fmt::format("{:.1f} iterations and ", static_cast<double>(solve.note.iterations) / solves) : "";
    report.say(fmt::format("    {}, solve for {}: {}, {}{} a solve{}\n", test.scene, solve.field, solve.note.method,
                           iterations, human_seconds(solve.note.seconds / solves),
                           by_steps && !solve.guess.empty() ? ", beginning with " + solve.guess : ""));
  }
}

void say_blow_up(Report& report, const TrajectoryTest& test) {
  std::vector<std::size_t> runs;
  double first = 0;
  for (std::size_t run = 0; run < test.runs.size(); ++run) {
    const auto at = std::ranges::find_if_not(test.runs[run], [](double value) { return std::isfinite(value); });
    if (at == test.runs[run].end()) continue;
    const double t = test.times[static_cast<std::size_t>(at - test.runs[run].begin())];
    first = runs.empty() ? t : std::min(first, t);
    runs.push_back(run);
  }
  if (runs.empty()) return;
  report.say(
      fmt::format("  warning: {} of scene {} is no longer finite in {} of {} runs of {} ({}), after t = {:.6g} from "
                  "its first frame "
                  "in the first of them to end\n",
                  test.name, test.scene, runs.size(), test.runs.size(), test.file, fmt::join(runs, ", "), first));
}

}  // namespace dpde::report
