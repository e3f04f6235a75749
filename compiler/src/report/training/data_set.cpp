// SPDX-License-Identifier: Apache-2.0
#include "report/training/data_set.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/maths/evaluate.h"

namespace dpde::report {

namespace {

/// Whether it is a history state of a time scheme or solve, not a declared state.
bool is_memory(training::DataSetMaker& maker, const std::string& name) {
  const model::State* state = maker.session().problem().find_state(name);
  return state != nullptr && !state->history_of.empty();
}

void report_estimates(training::DataSetMaker& maker, const std::vector<training::OrderEstimate>& estimates,
                      Report& report) {
  Json all = Json::object(), reasons = Json::object();
  for (const training::OrderEstimate& each : estimates) {
    if (is_memory(maker, each.variable)) continue;
    if (!each.is_known()) {
      reasons[each.variable] = each.why_not;
      report.say(fmt::format("{}: its error is not known: {}\n", each.variable, each.why_not));
      continue;
    }
    all[each.variable] = {{"order", json_number(each.order)},
                          {"difference", json_number(each.difference)},
                          {"error", json_number(each.error())}};
    report.say(
        fmt::format("{}: order {:.2f}, error about {:.2g} (from runs with twice and four times the spacing and step)\n",
                    each.variable, each.order, each.error()));
  }
  report.json["estimates"] = std::move(all);
  report.json["without_estimate"] = std::move(reasons);
}

void report_drifts(training::DataSetMaker& maker, const std::vector<training::DataRun>& runs, Report& report) {
  Json all = Json::object();
  for (std::size_t v = 0; v < maker.variables().size(); ++v) {
    const std::string& name = maker.variables()[v].name;
    if (!maker.variables()[v].is_kept || is_memory(maker, name)) continue;
    const auto drift = [v](const training::DataRun& run) { return run.integrals[v].drift(); };
    const auto most = std::ranges::max_element(runs, {}, drift);
    const double relative = most->integrals[v].relative_drift();
    all[name] = {
        {"drift", json_number(drift(*most))}, {"relative_drift", json_number(relative)}, {"run", most - runs.begin()}};
    report.say(fmt::format("{}: its integral drifts by at most {:.2g}, {:.2g} of that of its magnitude (run {})\n",
                           name, drift(*most), relative, most - runs.begin()));
  }
  report.json["conservation"] = std::move(all);
}

void report_residuals(const training::DataFile& file, Report& report) {
  Json all = Json::object();
  training::DataSetMaker& maker = file.maker;
  const std::vector<training::DataRun>& runs = file.runs;
  for (int s = 0; s < maker.session().rollout().state_count(); ++s) {
    const std::string& name = maker.session().rollout().state_name(s);
    if (is_memory(maker, name)) continue;
    const auto residual = [&](const training::DataRun& run) {
      return file.of(run).residuals[static_cast<std::size_t>(s)];
    };
    if (std::ranges::any_of(runs, [&](const training::DataRun& run) { return std::isnan(residual(run).rate); })) {
      all[name] = nullptr;
      report.say(fmt::format("{}: how well the frames satisfy the scene is not known: {}\n", name,
                             maker.times().size() < 2 ? "no frame follows another" : "it does not run on their grid"));
      continue;
    }
    const auto most =
        std::ranges::max_element(runs, {}, [&](const training::DataRun& run) { return residual(run).relative; });
    const auto [rate, relative] = residual(*most);
    all[name] = {{"rate", json_number(rate)}, {"relative", json_number(relative)}, {"run", most - runs.begin()}};
    report.say(
        fmt::format("{}: the scene's steps from a frame miss the next one by at most {:.2g} of the change "
                    "between them, {:.2g} in a unit of time (run {})\n",
                    name, shown(relative), shown(rate), most - runs.begin()));
  }
  report.json["residuals"] = std::move(all);
}

}  // namespace

Report data_set_report(const training::DataFile& file, const std::vector<training::OrderEstimate>& estimates) {
  training::DataSetMaker& maker = file.maker;
  const model::DataSet& set = maker.set();
  const std::vector<int> cells = maker.cells(file.grid());
  Report report;
  report.say(fmt::format("{}: {} runs of scene {}, {} frames from t = {:.6g} to {:.6g} on {} cells\n", set.name,
                         set.runs, set.scene, maker.times().size(), maker.times().front(), maker.times().back(),
                         fmt::join(cells, " x ")));
  report.json = {{"runs", set.runs}, {"frames", maker.times().size()}, {"cells", cells}};
  if (file.number == 0) {
    report_estimates(maker, estimates, report);
    report_drifts(maker, file.runs, report);
  }
  report_residuals(file, report);
  return report;
}

}  // namespace dpde::report
