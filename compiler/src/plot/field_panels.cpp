// SPDX-License-Identifier: Apache-2.0
#include "plot/field_panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <ranges>
#include <string>

#include "plot/curve.h"
#include "plot/map_shape.h"
#include "plot/scene_panels.h"
#include "support/names/number_text.h"

namespace dpde::plot {

namespace {

std::string title_of(const StoredField& field, std::size_t state) {
  if (field.times.empty()) return field.name;
  return field.name + ", " + time_text(field.times[state], field.time_unit);
}

Panel line_of(const StoredField& field, std::size_t state, const std::optional<ValueRange>& range) {
  const StoredAxis& x = field.axes[0];
  LinePanel panel;
  panel.title = title_of(field, state);
  panel.x_label = dpde::label_of(x.name, x.unit);
  panel.y_label = dpde::label_of(field.name, field.unit);
  panel.range = range;
  panel.x_range = ValueRange{std::min(x.low, x.high), std::max(x.low, x.high)};
  panel.curves.push_back(curve_of(panel.title, field.states[state],
                                  [&](std::size_t i) { return centre_of(x, static_cast<std::int64_t>(i)); }));
  return panel;
}

Panel map_of(const StoredField& field, std::size_t state, const std::optional<Slice>& slice,
             const std::optional<ValueRange>& range) {
  const std::size_t a = slice && slice->axis == 0 ? 1 : 0, b = !slice || slice->axis == 2 ? 1 : 2;
  const StoredAxis &x = field.axes[a], &y = field.axes[b];
  MapPanel panel;
  panel.title = title_of(field, state);
  set_axes(panel, field.system, {a, x.name, x.unit, x.high - x.low}, {b, y.name, y.unit, y.high - y.low});
  panel.value_label = dpde::label_of(field.name, field.unit);
  for (const auto& [axis, shown] : {std::pair(&x, &panel.x), std::pair(&y, &panel.y)}) {
    shown->cells = static_cast<int>(axis->cells);
    shown->low = axis->low;
    shown->high = axis->high;
    shown->faces = axis->faces;
    if (axis->grid) shown->frame = ValueRange{axis->grid->first, axis->grid->second};
  }
  panel.range = range;
  panel.values = field.states[state];
  if (!slice) return panel;
  const StoredAxis& across = field.axes[slice->axis];
  panel.title +=
      fmt::format(", {} = {:.4g}{}", across.name, centre_of(across, slice->index), behind_number(across.unit));
  panel.values = plane_of(panel.values, {field.axes[0].cells, field.axes[1].cells, field.axes[2].cells},
                          static_cast<int>(slice->axis), slice->index);
  return panel;
}

/// Range over all states, shared by the frames of a film.
std::optional<ValueRange> common_range(const StoredField& field) {
  std::vector<double> ends;
  for (const std::vector<double>& state : field.states) {
    if (const std::optional<ValueRange> range = range_of(state)) ends.insert(ends.end(), {range->low, range->high});
  }
  return range_of(ends);
}

}  // namespace

double centre_of(const StoredAxis& axis, std::int64_t i) {
  const auto n = static_cast<std::size_t>(i);
  if (!axis.faces.empty()) return (axis.faces[n] + axis.faces[n + 1]) / 2;
  return axis.low + (static_cast<double>(i) + 0.5) * (axis.high - axis.low) / static_cast<double>(axis.cells);
}

std::size_t state_at(const StoredField& field, const std::optional<double>& time) {
  std::size_t nearest = field.states.size() - 1;
  for (std::size_t k = 0; time && k < field.times.size(); ++k) {
    if (std::abs(field.times[k] - *time) < std::abs(field.times[nearest] - *time)) nearest = k;
  }
  return nearest;
}

void add_panels(const StoredField& field, std::size_t state, const std::optional<Slice>& slice,
                const std::optional<ValueRange>& range, std::vector<Panel>& panels) {
  if (field.axes.size() == 1) return panels.push_back(line_of(field, state, range));
  if (field.axes.size() == 2 || slice) return panels.push_back(map_of(field, state, slice, range));
  std::vector<Panel> planes;
  for (const std::size_t across : {2, 1, 0})
    planes.push_back(map_of(field, state, Slice{across, field.axes[across].cells / 2}, range));
  if (!range) share_range(planes);
  std::ranges::move(planes, std::back_inserter(panels));
}

MapPanel space_time_map(const StoredField& field) {
  const StoredAxis& x = field.axes[0];
  MapPanel panel;
  panel.title = field.name;
  panel.value_label = dpde::label_of(field.name, field.unit);
  panel.x = {dpde::label_of(x.name, x.unit), static_cast<int>(x.cells), x.low, x.high, x.faces};
  panel.y = {dpde::label_of("t", field.time_unit), static_cast<int>(field.times.size()), 0, 0};
  // A row reaches halfway to the times before and after.
  std::vector<double>& faces = panel.y.faces;
  const std::vector<double>& times = field.times;
  faces.push_back(times[0] - (times[1] - times[0]) / 2);
  for (std::size_t k = 0; k + 1 < times.size(); ++k) faces.push_back((times[k] + times[k + 1]) / 2);
  faces.push_back(2 * times.back() - faces.back());
  panel.y.low = faces.front();
  panel.y.high = faces.back();
  const double row = (panel.y.high - panel.y.low) / panel.y.cells;
  const auto is_even = [&](std::size_t k) { return std::abs(times[k] - times[0] - double(k) * row) < 1e-6 * row; };
  if (std::ranges::all_of(std::views::iota(std::size_t{0}, times.size()), is_even)) faces.clear();
  panel.y.frame = ValueRange{times.front(), times.back()};
  panel.shape = MapShape::stretched;
  for (const std::vector<double>& state : field.states)
    panel.values.insert(panel.values.end(), state.begin(), state.end());
  return panel;
}

std::vector<std::vector<Panel>> pages_of(const std::vector<StoredField>& fields,
                                         const std::vector<std::optional<Slice>>& slices, bool shares_range) {
  std::vector<std::optional<ValueRange>> ranges;
  for (const StoredField& field : fields) ranges.push_back(shares_range ? common_range(field) : std::nullopt);
  std::vector<std::vector<Panel>> pages(fields[0].states.size());
  for (std::size_t state = 0; state < pages.size(); ++state) {
    for (std::size_t f = 0; f < fields.size(); ++f) add_panels(fields[f], state, slices[f], ranges[f], pages[state]);
  }
  return pages;
}

}  // namespace dpde::plot
