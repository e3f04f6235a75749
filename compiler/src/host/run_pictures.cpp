// SPDX-License-Identifier: Apache-2.0
#include "host/run_pictures.h"

#include <algorithm>
#include <utility>

#include "dpde/runtime/error.h"
#include "plot/run_panels.h"

namespace dpde::host {

namespace {

namespace fs = std::filesystem;

/// Recorded time series of each state, for a scene of one cell.
std::vector<plot::Curve> course_of(const RunRecord& record, const std::vector<std::string>& states) {
  const Series& series = record.series()[0];
  const auto count = static_cast<std::int64_t>(series.places.size());
  std::vector<plot::Curve> course;
  for (const std::string& field : series.fields) {
    if (std::ranges::find(states, field) != states.end())
      course.push_back({field, series.times, record.states(series, field, 0, count)});
  }
  return course;
}

void add_picture(std::vector<std::string>& files, const fs::path& stem, const std::vector<plot::Panel>& panels) {
  if (panels.empty()) return;
  DiagnosticSink sink;
  for (const std::string& path : plot::draw(stem, panels, sink)) files.push_back(fs::path(path).filename().string());
  if (sink.has_errors()) throw Error(ErrorKind::machine, sink.all().front().message);
}

}  // namespace

std::function<std::vector<std::string>(const fs::path&, const RunRecord&, const RunEnd&)> drawing(
    std::shared_ptr<const driver::Compiled> compiled, std::vector<model::Axis> axes) {
  return [compiled = std::move(compiled), axes = std::move(axes)](const fs::path& folder, const RunRecord& record,
                                                                  const RunEnd& end) {
    const model::Problem& problem = *compiled->problem;
    const bool is_one_cell = std::ranges::all_of(axes, [](const model::Axis& axis) { return axis.cells == 1; });
    const plot::DrawnRun run{
        end.states,
        end.outputs,
        end.time,
        end.at_end,
        end.at_start,
        is_one_cell && record.keeps_states() ? course_of(record, end.states) : std::vector<plot::Curve>{}};
    std::vector<std::string> files;
    add_picture(files, folder / (problem.scene + "_observables"),
                plot::panels_of_observables(problem, record.series()[0]));
    add_picture(files, folder / problem.scene, plot::panels_of_run({problem, axes}, run));
    return files;
  };
}

}  // namespace dpde::host
