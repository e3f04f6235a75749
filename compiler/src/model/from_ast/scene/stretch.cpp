// SPDX-License-Identifier: Apache-2.0
// Reads the formula of a stretched axis and checks that it maps the axis onto itself.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "model/analyse/formula.h"
#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/names/known_values.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

constexpr double end_tolerance = 1e-9;    // of the extent
constexpr double slope_tolerance = 1e-6;  // of the slope

struct Checked {
  Elaboration& elaboration;
  const Axis& axis;
  SourceRange range;

  double start(int i) const { return axis.low + i * axis.spacing(); }
  bool fail(KindRef kind, std::initializer_list<std::string> arguments, const std::string& hint) const {
    elaboration.sink.report(kind, range, arguments, hint);
    return false;
  }
};

std::optional<Expr> formula_of(Elaboration& elaboration, const ast::Expr& e, int axis) {
  const std::string& name = elaboration.problem.axes[static_cast<std::size_t>(axis)].name;
  const std::optional<Expr> written =
      formulas::number({elaboration, FormulaContext::stretch, "the stretched axis " + name}, e);
  if (!written) return std::nullopt;
  const bool holds_others = any_part(*written, [&](const Expr& part) {
    const auto* coordinate = as<Coordinate>(part);
    return coordinate && coordinate->axis != axis;
  });
  if (!holds_others) return with_values(elaboration, *written);
  elaboration.sink.report("not-allowed-here", e.range(), {"another coordinate", "a stretched axis"},
                          fmt::format("the formula is made of numbers, parameters and {}", name));
  return std::nullopt;
}

/// The formula scaled to map the axis onto itself; f ranges from `from` to `to`.
std::string scaled(const Axis& axis, double from, double to) {
  if (!(to > from))
    return fmt::format("the formula has to give {} at {} = {} and {} at {} = {}", axis.low, axis.name, axis.low,
                       axis.high, axis.name, axis.high);
  const bool is_a_multiple = axis.high != 0 && to != 0 &&
                             std::abs(from * axis.high - axis.low * to) <= end_tolerance * std::abs(axis.high * to);
  if (is_a_multiple) return fmt::format("write f/({}), f this formula", to / axis.high);
  return fmt::format("write {} + (f - ({}))*{}, f this formula", axis.low, from, (axis.high - axis.low) / (to - from));
}

bool reaches_ends(const Checked& it, const Expr& map) {
  const double from = value_at(map, it.axis.low), to = value_at(map, it.axis.high);
  const double tolerance = end_tolerance * (it.axis.high - it.axis.low);
  if (std::abs(from - it.axis.low) <= tolerance && std::abs(to - it.axis.high) <= tolerance) return true;
  return it.fail("stretch-ends",
                 {it.axis.name, fmt::format("{}", from), fmt::format("{}", to), fmt::format("{}", it.axis.low),
                  fmt::format("{}", it.axis.high)},
                 scaled(it.axis, from, to));
}

bool is_finite(const Checked& it, const Expr& map) {
  for (int i = 0; i <= it.axis.cells; ++i) {
    if (std::isfinite(value_at(map, it.start(i)))) continue;
    return it.fail("not-finite", {fmt::format("the place of the face {} = {}", it.axis.name, it.start(i))}, "");
  }
  return true;
}

bool increases(const Checked& it, const Expr& map) {
  const std::string& name = it.axis.name;
  for (int i = 0; i < it.axis.cells; ++i) {
    const double from = value_at(map, it.start(i)), to = value_at(map, it.start(i + 1));
    if (from < to) continue;
    return it.fail(
        "stretch-not-increasing",
        {name, fmt::format("from {} = {} to {} it goes from {} to {}", name, it.start(i), it.start(i + 1), from, to)},
        "take a formula whose slope is positive everywhere");
  }
  const Expr slope = slope_of(map);
  std::vector<double> places{it.axis.low, it.axis.high};
  for (int i = 0; i < it.axis.cells; ++i) places.push_back(it.axis.low + (i + 0.5) * it.axis.spacing());
  for (const double s : places) {
    const double there = value_at(slope, s);
    if (there > 0 && std::isfinite(there)) continue;
    return it.fail("stretch-not-increasing", {name, fmt::format("its slope at {} = {} is {}", name, s, there)},
                   "the slope must be positive and finite, also at the ends");
  }
  return true;
}

bool is_as_periodic_as(const Checked& it, const Expr& map) {
  if (it.axis.topology == Topology::bounded) return true;
  const Expr slope = slope_of(map);
  const double begin = value_at(slope, it.axis.low), end = value_at(slope, it.axis.high);
  if (std::abs(begin - end) <= slope_tolerance * std::max(begin, end)) return true;
  return it.fail(
      "stretch-not-periodic", {it.axis.name, fmt::format("{}", begin), fmt::format("{}", end)},
      fmt::format("add a periodic function to the coordinate, as {0} + 0.1*sin(2*pi*{0}) on 0 .. 1", it.axis.name));
}

}  // namespace

Expr with_values(Elaboration& elaboration, const Expr& e) {
  fix_params(elaboration, e);
  KnownValues values = elaboration.params.values;
  for (auto& [name, value] : values) value = value.value_or(0);  // error reported
  return with_known(e, values);
}

void bind_stretch(Elaboration& elaboration, const ast::Expr& formula, int axis) {
  if (elaboration.blocks.program) {
    elaboration.sink.report("not-allowed-here", formula.range(), {"a stretched axis", "a scene of a program"},
                            "the kernels of a program say what their spacings are");
    return;
  }
  Axis& stretched = elaboration.problem.axes[static_cast<std::size_t>(axis)];
  const std::optional<Expr> map = formula_of(elaboration, formula, axis);
  if (!map) return;
  const Checked it{elaboration, stretched, formula.range()};
  const bool is_map =
      is_finite(it, *map) && reaches_ends(it, *map) && increases(it, *map) && is_as_periodic_as(it, *map);
  if (is_map) stretched.stretch = Stretch{*map, stretched.low, stretched.high};
}

}  // namespace dpde::model
