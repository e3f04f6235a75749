// SPDX-License-Identifier: Apache-2.0
// The axes of the scene, sorted x, y, z.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/from_ast/scene/cells_setting.h"

namespace dpde::model {

namespace {

constexpr std::int64_t max_total_cells = std::int64_t{1} << 31;

std::optional<int> as_cells(Elaboration& elaboration, double value, SourceRange range) {
  const bool fits = value >= 1 && value <= std::numeric_limits<int>::max() && value == std::floor(value);
  if (fits) return static_cast<int>(value);
  elaboration.sink.report("bad-cells", range, {fmt::format("{}", value)});
  return std::nullopt;
}

/// Cell counts of the line `cells` for each axis; null without a line.
struct Counts {
  std::vector<const ast::Expr*> of_axes;
  bool are_of_each = false;  // cells 64, 32, or 64 if no axis could use it: then no axis may have a count of its own
};

/// From the settings for this axis or all axes, else from the axis' own line, else from the line `cells`.
int cells_of(Elaboration& elaboration, const ast::GridItem& item, const Counts& counts, std::size_t axis,
             std::optional<double> of_setting) {
  const ast::Expr* counted = counts.of_axes[axis];
  const std::string key = "cells." + axis_name(axis_of(elaboration, item.axis.name));
  const bool is_set =
      elaboration.selection.overrides.contains(key) || elaboration.selection.overrides.contains("cells");
  if (is_set) {
    const auto for_this = number_setting(elaboration, key);
    const auto value = for_this ? for_this : of_setting;
    return value ? as_cells(elaboration, *value, {}).value_or(1) : 1;
  }
  elaboration.settings.add_known(key);
  if (item.cells && counted && counts.are_of_each)
    report_duplicate(elaboration, "the number of cells of " + item.axis.name, counted->range(), item.cells->range());
  if (item.cells) counted = &*item.cells;
  if (!counted) {
    elaboration.sink.report("missing-cells", item.axis.range, {item.axis.name}, "write , cells 128 after the extent");
    return 1;
  }
  const auto value = evaluate(elaboration, *counted, "the number of cells");
  return value ? as_cells(elaboration, *value, counted->range()).value_or(1) : 1;
}

Counts counts_of(Elaboration& elaboration, std::size_t axes) {
  Counts counts{std::vector<const ast::Expr*>(axes, nullptr)};
  const auto lines = items_of<ast::CellsItem>(elaboration.blocks.scene->items);
  for (std::size_t i = 1; i < lines.size(); ++i) report_duplicate(elaboration, "cells", lines[i].range, lines[0].range);
  if (lines.empty()) return counts;
  const std::vector<ast::Expr>& written = lines.front().kind.counts;
  if (written.size() != 1 && written.size() != axes) {
    elaboration.sink.report("wrong-length", lines.front().range,
                            {counted(static_cast<int>(axes), "number"), std::to_string(written.size())},
                            "write one number for all axes, or one for each");
  }
  // after an error any count will do
  for (std::size_t i = 0; i < axes; ++i) counts.of_axes[i] = &written[written.size() == axes ? i : 0];
  const bool is_unused = std::ranges::all_of(items_of<ast::GridItem>(elaboration.blocks.scene->items),
                                             [](const auto& line) { return line.kind.cells.has_value(); });
  counts.are_of_each = !lines.front().kind.is_of_other && (written.size() > 1 || is_unused);
  return counts;
}

/// A scene without a grid has one cell: ordinary differential equations.
void bind_one_cell(Elaboration& elaboration, std::optional<double> cells) {
  elaboration.problem.has_grid = false;
  Axis axis;
  axis.name = axis_name(0);
  axis.topology = Topology::periodic;
  axis.cells = cells ? as_cells(elaboration, *cells, {}).value_or(1) : 1;
  elaboration.problem.axes.push_back(axis);
}

/// Cell positions are computed in the precision of the fields.
void check_precision(Elaboration& elaboration, const ast::GridItem& item, const Axis& axis) {
  constexpr int most_single_cells = 1 << 24;
  if (elaboration.problem.scheme.real == Precision::f64 || axis.cells <= most_single_cells) return;
  elaboration.sink.report("bad-setting", item.cells ? item.cells->range() : item.axis.range,
                          {"real", "f32",
                           fmt::format("axis {} has {} cells, and single precision tells {} of them apart", axis.name,
                                       axis.cells, most_single_cells)},
                          "take fewer cells, or real = f64");
}

/// Features that depend on the order of cells are not available on a descending axis.
void check_falling(Elaboration& elaboration, const ast::GridItem& item) {
  const auto refuse = [&](const char* what, const char* hint) {
    elaboration.sink.report("not-allowed-here", item.high.range(), {"a decreasing axis", what}, hint);
  };
  if (elaboration.blocks.program)
    refuse("a scene of a program", "the kernels of a program say which neighbour is which");
  if (item.stretched) refuse("a grid line with stretched", "write the smaller end first, or leave stretched out");
}

void bind_extent(Elaboration& elaboration, const ast::GridItem& item, Axis& axis) {
  const auto low = evaluate(elaboration, item.low, "the grid"), high = evaluate(elaboration, item.high, "the grid");
  if (!low || !high) return;
  if (*low == *high) {
    elaboration.sink.report("empty-extent", item.high.range(), {fmt::format("{}", *low)});
    return;
  }
  if (!std::isfinite(*high - *low)) {
    elaboration.sink.report("not-finite", item.high.range(), {"the length of the axis"});
    return;
  }
  axis.low = std::min(*low, *high);
  axis.high = std::max(*low, *high);
  if (*low < *high) return;
  axis.ends = axis.low + axis.high;
  check_falling(elaboration, item);
}

/// For an unknown axis name: it may belong to other coordinates.
std::string hint_of_axis(const std::string& name) {
  constexpr std::pair<std::string_view, std::string_view> lines[] = {
      {"r", "polar, or coordinates cylinder,"}, {"theta", "polar"}, {"lon", "sphere(1)"}, {"lat", "sphere(1)"}};
  for (const auto& [axis, coordinates] : lines) {
    if (axis == name) return fmt::format("it is one with coordinates {} in the scene", coordinates);
  }
  return "the axes are x; x and y; or x, y and z";
}

/// The grid lines by axis; nullptr for an axis without one.
std::vector<const ast::GridItem*> grid_lines(Elaboration& elaboration) {
  std::vector<const ast::GridItem*> lines;
  for (const auto& [item, range] : items_of<ast::GridItem>(elaboration.blocks.scene->items)) {
    const int axis = axis_of(elaboration, item.axis.name);
    if (axis < 0) {
      elaboration.sink.report("unknown-axis", item.axis.range, {item.axis.name}, hint_of_axis(item.axis.name));
      continue;
    }
    if (axis >= static_cast<int>(lines.size())) lines.resize(axis + 1, nullptr);
    if (lines[axis]) report_duplicate(elaboration, "axis " + item.axis.name, item.axis.range, lines[axis]->axis.range);
    if (!lines[axis]) lines[axis] = &item;
  }
  return lines;
}

void check_total(Elaboration& elaboration) {
  double total = 1;
  for (const Axis& axis : elaboration.problem.axes) total *= axis.cells;
  if (total <= static_cast<double>(max_total_cells)) return;
  elaboration.sink.report("too-many-cells", elaboration.blocks.scene->name.range, {fmt::format("{}", total)});
}

}  // namespace

void bind_grid(Elaboration& elaboration) {
  const std::size_t before = elaboration.sink.all().size();
  bind_axis_names(elaboration);
  const std::vector<const ast::GridItem*> lines = grid_lines(elaboration);
  const std::vector<std::optional<double>> set_cells =
      cells_setting(elaboration, std::max<std::size_t>(1, lines.size()));
  const bool has_lines = !items_of<ast::GridItem>(elaboration.blocks.scene->items).empty();
  const bool has_cells = !items_of<ast::CellsItem>(elaboration.blocks.scene->items).empty();
  if (!has_lines && !has_cells && elaboration.blocks.model) return bind_one_cell(elaboration, set_cells[0]);
  if (!has_lines) {
    elaboration.sink.report("missing-grid", elaboration.blocks.scene->name.range, {elaboration.problem.scene},
                            "write grid x = 0 .. 1, cells 128, periodic");
  }
  const Counts counts = counts_of(elaboration, lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    Axis axis;
    axis.name = axis_name(static_cast<int>(i));
    if (lines[i]) {
      if (lines[i]->periodic) axis.topology = Topology::periodic;
      if (!lines[i]->periodic) axis.topology = Topology::bounded;
      bind_extent(elaboration, *lines[i], axis);
      axis.cells = cells_of(elaboration, *lines[i], counts, i, set_cells[i]);
      check_precision(elaboration, *lines[i], axis);
    } else {
      elaboration.sink.report("axes-not-in-order", lines.back()->axis.range, {lines.back()->axis.name, axis.name},
                              fmt::format("call the axes x{}", lines.size() == 2 ? "" : " and y"));
    }
    elaboration.problem.axes.push_back(axis);
  }
  if (lines.empty()) elaboration.problem.axes.push_back({axis_name(0)});
  check_total(elaboration);
  if (elaboration.sink.all().size() != before) return;
  measure_axes(elaboration);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i] && lines[i]->stretched) bind_stretch(elaboration, *lines[i]->stretched, static_cast<int>(i));
  }
  bind_metric(elaboration);
}

}  // namespace dpde::model
