// SPDX-License-Identifier: Apache-2.0
#include "plot/run_panels.h"

#include <utility>

#include "driver/report/run_description.h"

namespace dpde::plot {

std::vector<Panel> panels_of_run(const SceneView& scene, const DrawnRun& run) {
  if (!run.course.empty()) return {panel_of_course(scene.problem, run.course)};
  const std::string when = time_text(scene.problem, run.time);
  std::vector<Panel> panels;
  const auto add = [&](const std::string& title, const std::string& field, std::vector<double> values) {
    add_state(panels, scene, when,
              {title, std::move(values), driver::placement_of(scene.problem, field), label_of(scene.problem, field)});
  };
  for (const std::string& state : run.states) add(state, state, run.at_end(state));
  for (const std::string& output : run.outputs) add(output, output, run.at_end(output));
  if (scene.axes.size() > 1 || run.at_start == nullptr) return panels;
  for (const std::string& state : run.states) add(state + " at the start", state, run.at_start(state));
  return panels;
}

LinePanel panel_of_course(const model::Problem& problem, std::vector<Curve> course) {
  LinePanel panel;
  panel.x_label = label_of(problem, "t");
  for (const Curve& curve : course) {
    panel.title += (panel.title.empty() ? "" : ", ") + curve.title;
    add_label(panel.y_label, label_of(problem, curve.title));
  }
  panel.curves = std::move(course);
  return panel;
}

std::vector<Panel> panels_of_observables(const model::Problem& problem, const Series& series) {
  std::vector<Panel> panels;
  if (series.times.size() < 3) return panels;
  for (std::size_t q = 0; q < series.observables.front().size(); ++q) {
    LinePanel panel;
    panel.title = series.observables.front()[q].first;
    panel.x_label = label_of(problem, "t");
    panel.y_label = label_of(problem, panel.title);
    Curve curve{panel.title, series.times, {}};
    for (const auto& row : series.observables) curve.y.push_back(row[q].second);
    panel.curves.push_back(std::move(curve));
    panel.log_y = spans_decades(panel.curves);
    panels.push_back(std::move(panel));
  }
  return panels;
}

}  // namespace dpde::plot
