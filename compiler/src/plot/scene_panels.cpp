// SPDX-License-Identifier: Apache-2.0
#include "plot/scene_panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>
#include <span>
#include <tuple>

#include "driver/report/run_description.h"
#include "model/analyse/placement.h"
#include "plot/bodies.h"
#include "plot/curve.h"
#include "plot/map_shape.h"
#include "support/names/number_text.h"

namespace dpde::plot {

namespace {

/// Empty if all cells have the same width.
std::vector<double> faces_of(const model::Axis& axis) {
  std::vector<double> faces;
  for (int i = 0; axis.stretch && i <= axis.cells; ++i) faces.push_back(axis.face(i));
  return faces;
}

/// From end to end, also of an axis whose coordinates decrease.
ValueRange extent_of(const model::Axis& axis) {
  const double first = axis.face(0), last = axis.face(axis.cells);
  return {std::min(first, last), std::max(first, last)};
}

/// A map of the plane, without values. `axes`: those of the field's placement.
MapPanel empty_map(const SceneView& scene, const std::vector<model::Axis>& axes, const std::string& title,
                   const Plane& plane) {
  const model::Problem& problem = scene.problem;
  const model::Axis &a = axes[plane.a], &b = axes[plane.b];
  MapPanel panel;
  panel.title = title;
  const auto named = [&](std::size_t axis) {
    const model::Axis& along = axes[axis];
    return ShownAxis{axis, driver::called(problem, along.name), problem.unit_of(along.name),
                     along.face(along.cells) - along.face(0)};
  };
  set_axes(panel, problem.metric ? std::optional(problem.metric->system) : std::nullopt, named(plane.a),
           named(plane.b));
  const model::Axis &grid_a = scene.axes[plane.a], &grid_b = scene.axes[plane.b];
  for (const auto& [axis, grid, shown] : {std::tuple(&a, &grid_a, &panel.x), std::tuple(&b, &grid_b, &panel.y)}) {
    shown->cells = axis->cells;
    shown->low = axis->face(0);
    shown->high = axis->face(axis->cells);
    shown->faces = faces_of(*axis);
    shown->frame = extent_of(*grid);
  }
  panel.lines = outlines(scene.problem, scene.axes, plane, scene.time);
  return panel;
}

/// On two axes the plane; on three axes the three middle planes, beginning with the one normal to the last axis.
std::vector<Panel> maps_of(const SceneView& scene, const std::string& title, NamedState state) {
  const std::vector<model::Axis> axes = model::axes_at(scene.axes, state.placement);
  if (axes.size() == 2) {
    MapPanel panel = empty_map(scene, axes, title, {});
    panel.value_label = state.label;
    panel.values = std::move(state.values);
    return {std::move(panel)};
  }
  std::vector<Panel> panels;
  for (const std::size_t across : {2, 1, 0}) {
    const Plane plane{across == 0 ? 1u : 0u, across == 2 ? 1u : 2u, across};
    const model::Axis& cut = axes[across];
    const int middle = cut.cells / 2;
    const std::string where = fmt::format("{}, {} = {:.4g}{}", title, driver::called(scene.problem, cut.name),
                                          cut.centre(middle), behind_number(scene.problem.unit_of(cut.name)));
    MapPanel panel = empty_map(scene, axes, where, plane);
    panel.value_label = state.label;
    panel.values =
        plane_of(state.values, {axes[0].cells, axes[1].cells, axes[2].cells}, static_cast<int>(across), middle);
    panels.push_back(std::move(panel));
  }
  share_range(panels);
  return panels;
}

/// The second minus the first.
NamedState difference_of(const NamedState& first, const NamedState& second) {
  NamedState difference = second;
  difference.title = fmt::format("{} \u2212 {}", second.title, first.title);
  for (std::size_t i = 0; i < difference.values.size(); ++i) difference.values[i] -= first.values[i];
  return difference;
}

/// Colours of the same scale as those of the compared maps, around 0; wider only if the difference is larger than that.
/// The title says how large it is.
void set_range_of_difference(MapPanel& panel, const std::optional<ValueRange>& compared) {
  const std::optional<ValueRange> own = range_of(panel.values);
  if (!own || !compared) return;
  const double size = std::max(std::abs(own->low), std::abs(own->high));
  const ValueRange shown = colours_of(compared).range;
  const double bound = std::max((shown.high - shown.low) / 2, size);
  if (bound > 0) panel.range = ValueRange{-bound, bound};
  panel.title += fmt::format(", at most {:.3g}", size);
}

}  // namespace

/// Appends a name to an axis label, without duplicates; the label is empty if it would be too long.
void add_label(std::string& label, const std::string& more) {
  constexpr std::size_t longest = 60;
  const bool is_there = (", " + label + ", ").find(", " + more + ", ") != std::string::npos;
  if (!is_there) label += (label.empty() ? "" : ", ") + more;
  if (label.size() > longest) label = " ";
}

std::string label_of(const model::Problem& problem, const std::string& name) {
  return dpde::label_of(driver::called(problem, name), problem.unit_of(name));
}

std::string time_text(double t, const std::string& unit) {
  constexpr double day = 86400, most_digits = 1e9;
  if (unit == "s" && std::abs(t) >= 2 * day) return fmt::format("t = {:.6g} d", t / day);
  const bool is_whole = t == std::floor(t) && std::abs(t) < most_digits;
  return fmt::format("t = {}{}", is_whole ? fmt::format("{:.0f}", t) : fmt::format("{:.6g}", t), behind_number(unit));
}

std::string time_text(const model::Problem& problem, double t) { return time_text(t, problem.unit_of("t")); }

Curve curve_of(const SceneView& scene, const NamedState& state) {
  const model::Axis axis = model::axes_at(scene.axes, state.placement)[0];
  return curve_of(state.title, state.values, [&](std::size_t i) { return axis.centre(static_cast<int>(i)); });
}

void add_state(std::vector<Panel>& panels, const SceneView& scene, const std::string& title, NamedState state) {
  if (scene.axes.size() > 1) {
    const std::string of_map = title.empty() ? state.title : state.title + ", " + title;
    for (Panel& panel : maps_of(scene, of_map, std::move(state))) panels.push_back(std::move(panel));
    return;
  }
  if (panels.empty()) {
    LinePanel panel;
    panel.title = title;
    const model::Axis& axis = scene.axes[0];
    panel.x_label = label_of(scene.problem, axis.name);
    panel.x_range = extent_of(axis);
    panels.push_back(std::move(panel));
  }
  LinePanel& panel = std::get<LinePanel>(panels.back());
  add_label(panel.y_label, state.label);
  panel.curves.push_back(curve_of(scene, state));
}

std::vector<Panel> panels_of(const SceneView& scene, const std::string& title, std::vector<NamedState> states) {
  const bool are_compared = states.size() == 2 && scene.axes.size() > 1;
  if (are_compared) states.push_back(difference_of(states[0], states[1]));
  const std::size_t count = states.size();
  std::vector<Panel> panels;
  for (NamedState& state : states) add_state(panels, scene, title, std::move(state));
  if (LinePanel* lines = std::get_if<LinePanel>(&panels.front()); lines != nullptr && count == 2)
    lines->curves[1].is_dashed = true;
  const std::size_t planes = panels.size() / count;
  const std::span differences = std::span(panels).subspan(are_compared ? 2 * planes : panels.size());
  share_range(std::span(panels).first(panels.size() - differences.size()));
  for (Panel& panel : differences)
    set_range_of_difference(std::get<MapPanel>(panel), std::get<MapPanel>(panels.front()).range);
  if (scene.axes.size() < 3 || count < 2) return panels;
  std::vector<Panel> side_by_side;  // the same plane of all states
  for (std::size_t plane = 0; plane < planes; ++plane) {
    for (std::size_t s = 0; s < count; ++s) side_by_side.push_back(std::move(panels[s * planes + plane]));
  }
  return side_by_side;
}

std::vector<Panel> panels_of_field(driver::Session& session, const std::string& field, const std::string& title,
                                   const std::string& label,
                                   const std::vector<std::pair<std::string, std::vector<double>>>& states) {
  const std::size_t size = session.workspace().cell_count(), last = states.front().second.size() / size - 1;
  const model::Coefficient* control = session.problem().find_coefficient(field);
  std::vector<Panel> panels;
  for (const std::size_t interval : std::set<std::size_t>{0, last / 2, last}) {
    std::vector<NamedState> named;
    for (const auto& [name, values] : states) {
      const auto begin = values.begin() + std::ptrdiff_t(interval * size);
      named.push_back(
          {name, {begin, begin + std::ptrdiff_t(size)}, driver::placement_of(session.problem(), field), label});
    }
    const std::string when =
        last == 0 || control == nullptr
            ? ""
            : " from " + time_text(session.problem(), session.time_of(int(interval) * control->every));
    std::vector<Panel> more = panels_of(session, title + when, std::move(named));
    panels.insert(panels.end(), more.begin(), more.end());
  }
  return panels;
}

}  // namespace dpde::plot
