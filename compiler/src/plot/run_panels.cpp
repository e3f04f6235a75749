// SPDX-License-Identifier: Apache-2.0
#include "plot/run_panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "driver/report/centres.h"
#include "driver/report/run_description.h"
#include "model/analyse/flows.h"

namespace dpde::plot {

namespace {

/// Slopes along an axis at the centres: central differences, at walls one-sided.
std::vector<double> slopes(const std::vector<double>& values, const std::vector<model::Axis>& axes, std::size_t along) {
  const model::Axis& axis = axes[along];
  const int cells = axis.cells;
  const std::size_t stride = along == 0 ? 1 : static_cast<std::size_t>(axes[0].cells);
  const double length = axis.face(cells) - axis.face(0);
  const bool is_periodic = axis.topology == Topology::periodic;
  std::vector<double> result(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const int at = static_cast<int>(i / stride) % cells;
    const bool wraps_below = at == 0 && is_periodic, wraps_above = at + 1 == cells && is_periodic;
    const int below = wraps_below ? cells - 1 : std::max(at - 1, 0),
              above = wraps_above ? 0 : std::min(at + 1, cells - 1);
    const double distance = axis.centre(above) - axis.centre(below) + (wraps_below + wraps_above) * length;
    const auto value = [&](int cell) {
      return values[i + static_cast<std::size_t>(cell) * stride - static_cast<std::size_t>(at) * stride];
    };
    result[i] = distance == 0 ? 0 : (value(above) - value(below)) / distance;
  }
  return result;
}

/// dx(u.y) - dy(u.x) at the centres.
std::vector<double> vorticity_of(const SceneView& scene, const std::string& flow, const DrawnRun& run) {
  const auto component = [&](const std::string& name) {
    return driver::at_centres(scene.problem, scene.axes, name, run.at_end(name));
  };
  std::vector<double> vorticity = slopes(component(flow + ".y"), scene.axes, 0);
  const std::vector<double> other = slopes(component(flow + ".x"), scene.axes, 1);
  for (std::size_t i = 0; i < vorticity.size(); ++i) vorticity[i] -= other[i];
  return vorticity;
}

/// The size that all but a hundredth of the values keep.
double size_of_most(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Shear in the cells at walls and bodies may be many times that of vortices, which would be pale then: colours end at
/// the size that a hundredth of the cells exceeds, and the label says so.
void add_vorticity(std::vector<Panel>& panels, const SceneView& scene, const std::string& flow, const DrawnRun& run) {
  std::vector<double> values = vorticity_of(scene, flow, run);
  const double most = size_of_most(values);
  const std::optional<ValueRange> range = range_of(values);
  const bool is_cut = range && std::max(-range->low, range->high) > 2 * most && most > 0;
  const std::string label =
      fmt::format("dx({0}.y) \u2212 dy({0}.x){1}", flow, is_cut ? "; beyond the colours in 1 % of the cells" : "");
  add_state(panels, scene, time_text(scene.problem, run.time), {"vorticity of " + flow, std::move(values), {}, label});
  if (is_cut) std::get<MapPanel>(panels.back()).range = ValueRange{-most, most};
}

}  // namespace

std::vector<Panel> panels_of_run(const SceneView& given, const DrawnRun& run) {
  if (!run.course.empty()) return {panel_of_course(given.problem, run.course)};
  SceneView scene = given;
  scene.time = run.time;
  const std::string when = time_text(scene.problem, run.time);
  std::vector<Panel> panels;
  const auto add = [&](const std::string& title, const std::string& field, std::vector<double> values) {
    add_state(panels, scene, when,
              {title, std::move(values), driver::placement_of(scene.problem, field), label_of(scene.problem, field)});
  };
  for (const std::string& state : run.states) add(state, state, run.at_end(state));
  for (const std::string& output : run.outputs) add(output, output, run.at_end(output));
  for (const std::string& flow : model::flows_in_plane(scene.problem)) add_vorticity(panels, scene, flow, run);
  if (scene.axes.size() > 1 || run.at_start == nullptr) return panels;
  LinePanel& lines = std::get<LinePanel>(panels.front());
  for (std::size_t s = 0; s < run.states.size(); ++s) {
    std::vector<double> start = run.at_start(run.states[s]);
    const bool is_constant = std::ranges::adjacent_find(start, std::not_equal_to<>()) == start.end();
    if (is_constant) continue;  // says nothing, as of fields that the step computes
    add(run.states[s] + " at the start", run.states[s], std::move(start));
    lines.curves.back().colour = colour_of_curve(s);
    lines.curves.back().is_dashed = true;
  }
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
