// SPDX-License-Identifier: Apache-2.0
// coordinates polar, cylinder, sphere(a), metric(h1, h2): lengths of units of the coordinates, and ends of axes that
// are poles.
#include "model/boundary/metric.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <numbers>

#include "model/analyse/formula.h"
#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/from_ast/scene/coordinates.h"
#include "support/assert.h"
#include "support/maths/evaluate.h"

namespace dpde::model {

namespace {

/// The scene's line: its name and arguments.
struct WrittenCoordinates {
  std::string kind;
  SourceRange range;
  std::vector<ast::Argument> arguments;
};

std::optional<WrittenCoordinates> written(Elaboration& elaboration) {
  const auto lines = items_of<ast::CoordinatesItem>(elaboration.blocks.scene->items);
  if (lines.empty()) return std::nullopt;
  if (lines.size() > 1) report_duplicate(elaboration, "coordinates", lines[1].range, lines[0].range);
  const ast::Expr& kind = lines.front().kind.kind;
  if (const auto* name = std::get_if<ast::Name>(&kind->kind)) return WrittenCoordinates{name->name, kind.range(), {}};
  const auto* call = std::get_if<ast::Call>(&kind->kind);
  return WrittenCoordinates{call ? call->callee : "", kind.range(),
                            call ? call->arguments : std::vector<ast::Argument>{}};
}

constexpr const char* kinds_hint =
    "write coordinates polar (x is r, y is theta), cylinder (x is r, y is z), sphere(a) (x is the longitude, y the "
    "latitude) or metric(h_x, h_y), lengths of units of x and y";

std::vector<std::string> names_of_axes(CoordinateSystem system) {
  switch (system) {
    case CoordinateSystem::given: return {};
    case CoordinateSystem::polar: return {"r", "theta"};
    case CoordinateSystem::cylinder: return {"r"};
    case CoordinateSystem::sphere: return {"lon", "lat"};
  }
  unreachable("coordinate system");
}

class MetricBinder {
 public:
  MetricBinder(Elaboration& elaboration, WrittenCoordinates line) : elaboration_(elaboration), line_(std::move(line)) {}

  void bind() {
    auto metric = made();
    if (!metric || !is_positive(*metric) || !closes(*metric)) return;
    metric->system = system_of(line_.kind);
    metric->axes = names_of_axes(metric->system);
    elaboration_.problem.metric = metric;
  }

 private:
  int axes() const { return static_cast<int>(elaboration_.problem.axes.size()); }

  bool takes(std::size_t count, const std::string& what) {
    if (line_.arguments.size() == count) return true;
    elaboration_.sink.report("wrong-argument-count", line_.range,
                             {line_.kind, what, std::to_string(line_.arguments.size())}, kinds_hint);
    return false;
  }
  bool fits_axes(bool fits, const std::string& wanted) {
    if (!fits)
      elaboration_.sink.report("wrong-axes-of-coordinates", line_.range,
                               {line_.kind + " coordinates", wanted, counted(axes(), "axis")}, kinds_hint);
    return fits;
  }
  std::optional<Expr> formula(const ast::Expr& e) {
    const auto value = formulas::number({elaboration_, FormulaContext::scale, "the coordinates"}, e);
    return value ? std::optional(with_values(elaboration_, *value)) : std::nullopt;
  }

  std::optional<Metric> made() {
    const Expr x = coordinate(0), y = coordinate(1), none = 1.0;
    if (line_.kind == "polar") {
      const bool fits = takes(0, "no arguments") && fits_axes(axes() >= 2, "the axes r and theta, and maybe z");
      return fits ? std::optional(
                        Metric{"polar coordinates", axes() == 2 ? std::vector{none, x} : std::vector{none, x, none}})
                  : std::nullopt;
    }
    if (line_.kind == "cylinder") {
      const bool fits = takes(0, "no arguments") && fits_axes(axes() <= 2, "the axis r, and maybe z");
      const Expr around = binary(BinaryOp::multiply, 2 * std::numbers::pi, x);
      return fits ? std::optional(
                        Metric{"cylinder coordinates", std::vector(static_cast<std::size_t>(axes()), none), around})
                  : std::nullopt;
    }
    if (line_.kind == "sphere") {
      if (!takes(1, "the radius") || !fits_axes(axes() == 2, "the axes lon and lat")) return std::nullopt;
      const auto radius = formula(line_.arguments[0].value);
      if (!radius) return std::nullopt;
      return Metric{"sphere coordinates", {binary(BinaryOp::multiply, *radius, call(Fn::cos, {y})), *radius}};
    }
    if (line_.kind == "metric") return given();
    elaboration_.sink.report("unknown-coordinates", line_.range, {line_.kind.empty() ? "this" : line_.kind},
                             kinds_hint);
    return std::nullopt;
  }

  std::optional<Metric> given() {
    if (!takes(static_cast<std::size_t>(axes()), fmt::format("a length for each axis ({})", axes())))
      return std::nullopt;
    Metric metric{"the coordinates of the scene", {}};
    for (const ast::Argument& argument : line_.arguments) {
      const auto scale = formula(argument.value);
      if (!scale) return std::nullopt;
      metric.scales.push_back(*scale);
    }
    return metric;
  }

  /// Checks lengths in all cells and on all inner faces. The length along an axis is also checked at its own ends: at a
  /// pole only the units of other coordinates have no length.
  bool is_positive(const Metric& metric) {
    std::vector<Expr> lengths = metric.scales;
    lengths.push_back(metric.around);
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const std::string name = i < metric.scales.size() ? written_axis(elaboration_, i) : "the angle around the axis";
      if (!is_positive(lengths[i], name, static_cast<int>(i))) return false;
    }
    return true;
  }

  /// `along`: the axis of this length.
  bool is_positive(const Expr& length, const std::string& of, int along) {
    std::vector<std::array<double, 3>> places{{}};
    for (std::size_t a = 0; a < elaboration_.problem.axes.size(); ++a) {
      if (!depends_on_axis(length, static_cast<int>(a))) continue;
      const Axis& axis = elaboration_.problem.axes[a];
      std::vector<std::array<double, 3>> more;
      for (const std::array<double, 3>& place : places) {
        for (int i = 0; i < axis.cells; ++i) {
          more.push_back(place);
          more.back()[a] = axis.centre(i);
          if (i == 0) continue;
          more.push_back(place);
          more.back()[a] = axis.face(i);
        }
        for (const double end : {axis.low, axis.high}) {
          if (static_cast<int>(a) != along) continue;
          more.push_back(place);
          more.back()[a] = end;
        }
      }
      places = std::move(more);
    }
    for (const std::array<double, 3>& place : places) {
      const double value = value_at(length, place);
      if (value > 0 && std::isfinite(value)) continue;
      std::vector<std::string> where;
      for (std::size_t a = 0; a < elaboration_.problem.axes.size(); ++a)
        where.push_back(fmt::format("{} = {:.6g}", written_axis(elaboration_, a), place[a]));
      elaboration_.sink.report(
          "metric-vanishes", line_.range,
          {of, fmt::format("{:.6g}", dpde::shown(value)), fmt::format("{}", fmt::join(where, ", "))},
          hint_of_lengths());
      return false;
    }
    return true;
  }

  std::string hint_of_lengths() const {
    constexpr double right_angle = std::numbers::pi / 2;
    const Axis& last = elaboration_.problem.axes.back();
    const bool is_in_degrees = line_.kind == "sphere" && std::max(std::abs(last.low), std::abs(last.high)) > 4;
    if (is_in_degrees) return "angles are in radians: grid lon = 0 .. 2*pi, grid lat = -pi/2 .. pi/2";
    if (line_.kind == "sphere" && std::max(std::abs(last.low), std::abs(last.high)) > right_angle)
      return "the latitude is an angle from -pi/2 to pi/2";
    return "lengths are positive and finite inside of the grid, and at the sides of their own axes; at a side of "
           "another axis they may be 0, which is a pole";
  }

  /// Whether lengths agree at both ends of a periodic axis, which are the same points.
  bool closes(const Metric& metric) {
    for (std::size_t a = 0; a < elaboration_.problem.axes.size(); ++a) {
      if (elaboration_.problem.axes[a].topology != Topology::periodic) continue;
      for (std::size_t i = 0; i < metric.scales.size(); ++i) {
        if (!closes(metric.scales[i], i, a)) return false;
      }
      if (!closes(metric.around, metric.scales.size(), a)) return false;
    }
    return true;
  }

  bool closes(const Expr& length, std::size_t of, std::size_t axis) {
    constexpr double tolerance = 1e-6;
    const std::vector<Axis>& axes = elaboration_.problem.axes;
    for (const double beside : {0.31, 0.57, 0.83}) {
      std::array<double, 3> place{};
      for (std::size_t a = 0; a < axes.size(); ++a) place[a] = axes[a].low + beside * (axes[a].high - axes[a].low);
      place[axis] = axes[axis].low;
      const double low = value_at(length, place);
      place[axis] = axes[axis].high;
      const double high = value_at(length, place);
      if (std::abs(low - high) <= tolerance * std::max(std::abs(low), std::abs(high))) continue;
      const std::string name = of < axes.size() ? written_axis(elaboration_, of) : "the angle around the axis";
      elaboration_.sink.report(
          "metric-not-periodic", line_.range,
          {name, fmt::format("{:.6g}", low), written_axis(elaboration_, axis), fmt::format("{:.6g}", high)},
          "take a formula that is periodic, or leave out periodic in the grid line: walls stand there");
      return false;
    }
    return true;
  }

  Elaboration& elaboration_;
  WrittenCoordinates line_;
};

class Poles {
 public:
  explicit Poles(Elaboration& elaboration) : elaboration_(elaboration) {}

  void check() {
    Problem& problem = elaboration_.problem;
    const bool is_refused = !problem.metric && written(elaboration_);
    if (is_refused) return;
    for (std::size_t axis = 0; axis < problem.axes.size(); ++axis) {
      for (const bool is_low : {true, false}) look_at(axis, is_low);
    }
  }

 private:
  /// Whether a field's component along an axis changes sign across the pole, as x and y do.
  bool turns_round(const std::string& name) const {
    const int along = is_component(name) ? axis_of(name.substr(name.find('.') + 1)) : -1;
    return along == 0 || along == 1;
  }

  bool is_component(const std::string& name) const {
    const Symbol* vector = elaboration_.names.scope.find(vector_of(name));
    return vector && vector->is_vector;
  }

  void look_at(std::size_t axis, bool is_low) {
    Problem& problem = elaboration_.problem;
    const bool is_pole = is_pole_at(problem, axis, is_low);
    const std::string place = side_name(problem.axes[axis], is_low);
    const std::string end = place.substr(place.find('.'));
    if (is_pole && !runs_around(axis, written_axis(elaboration_, axis) + end)) return;
    SourceRange line = elaboration_.blocks.scene->name.range;
    for (const auto& [grid, range] : items_of<ast::GridItem>(elaboration_.blocks.scene->items)) {
      if (grid.axis.name == written_axis(elaboration_, axis)) line = grid.axis.range;
    }
    for (State& state : problem.states) {
      if (axis >= state.boundary.size()) continue;
      Side& side = is_low ? state.boundary[axis].low : state.boundary[axis].high;
      const SourceRange range = boundary_of_side(elaboration_, state.name, place).value_or(line);
      const Side& opposite = is_low ? state.boundary[axis].high : state.boundary[axis].low;
      const bool lack_both = is_pole && is_pole_at(problem, axis, !is_low) && lacks_pole(state, side, axis) &&
                             lacks_pole(state, opposite, axis);  // a single error
      const std::string written = written_axis(elaboration_, axis) + (lack_both ? "" : end);
      if (state.velocity_of.empty() && (is_low || !lack_both)) check(state, side, axis, written, range, is_pole);
      if (side.kind == SideKind::pole && turns_round(state.name)) side.kind = SideKind::opposite_pole;
    }
    for (Coefficient& coefficient : problem.coefficients) {
      bool& at_pole = is_low ? coefficient.at_poles[axis].low : coefficient.at_poles[axis].high;
      at_pole = is_pole && !coefficient.placement[axis];
      coefficient.turns_round = turns_round(coefficient.name);
    }
  }

  static bool lacks_pole(const State& state, const Side& side, std::size_t axis) {
    const bool is_closed = side.kind == SideKind::value && is_literal(side.value, 0);
    return state.placement[axis] ? !is_closed : side.kind != SideKind::pole;
  }

  void check(const State& state, const Side& side, std::size_t axis, const std::string& place, SourceRange range,
             bool is_pole) {
    const bool is_asked = side.kind == SideKind::pole;
    if (state.placement[axis]) {
      if (is_pole && lacks_pole(state, side, axis))
        elaboration_.sink.report(
            "pole-without-boundary", range, {state.name, place},
            is_component(state.name)
                ? fmt::format("write {} = 0: faces have no size at the pole, and nothing flows through them", place)
                : fmt::format("a number there lies on the pole itself: take it to the centres, or write {} = 0",
                              place));
      else if (is_asked)
        elaboration_.sink.report("no-pole", range, {place}, "fields on faces across the axis have a value there");
      return;
    }
    if (is_pole && !is_asked)
      elaboration_.sink.report("pole-without-boundary", range, {state.name, place},
                               fmt::format("write {} = pole: the cell beyond it lies half a turn away", place));
    if (is_asked && !is_pole) elaboration_.sink.report("no-pole", range, {place}, hint_of_side(state, axis, place));
  }

  std::string hint_of_side(const State& state, std::size_t axis, const std::string& place) const {
    const std::optional<Metric>& metric = elaboration_.problem.metric;
    if (!metric || !depends_on_axis(metric->around, static_cast<int>(axis)))
      return "a pole is where a unit of another coordinate has no length: r = 0 in coordinates polar, lat = -pi/2 and "
             "pi/2 in coordinates sphere(a)";
    const bool is_across = is_component(state.name) && axis_of(state.name.substr(state.name.find('.') + 1)) == 0;
    return fmt::format("the axis of a cylinder is no pole: write {} = {}, ", place, is_across ? "0" : "zero_gradient") +
           (is_across ? "as nothing flows through it" : "as all is the same around it");
  }

  bool runs_around(std::size_t axis, const std::string& place) {
    const std::size_t around = axis == 0 ? 1 : 0;
    const Axis& other = elaboration_.problem.axes[around];
    const SourceRange range = items_of<ast::CoordinatesItem>(elaboration_.blocks.scene->items).front().range;
    const auto fail = [&](const std::string& why, const std::string& hint) {
      elaboration_.sink.report("not-around-pole", range, {written_axis(elaboration_, around), place, why}, hint);
      return false;
    };
    if (axis > 1) return fail("poles are on the axes x and y", "");
    if (other.topology != Topology::periodic) return fail("it is not periodic", "write periodic in its grid line");
    if (other.cells % 2 != 0)
      return fail(fmt::format("it has {} cells", other.cells),
                  "beyond a pole lies the cell half a turn away: take an even number of cells");
    if (elaboration_.problem.scheme.is_semi_lagrangian())
      return fail("semi-Lagrangian advection does not cross a pole", "take advect = upwind(3), weno(5) or central(2)");
    const bool is_angle = !elaboration_.names.axis_names.empty();
    if (is_angle && std::abs(other.high - other.low - 2 * std::numbers::pi) > 1e-9)
      return fail(fmt::format("it reaches from {} to {}", other.low, other.high), "let it reach from 0 to 2*pi");
    return true;
  }

  Elaboration& elaboration_;
};

}  // namespace

void bind_axis_names(Elaboration& elaboration) {
  const auto line = written(elaboration);
  const std::vector<std::string> names = line ? names_of_axes(system_of(line->kind)) : std::vector<std::string>{};
  for (std::size_t a = 0; a < names.size(); ++a) elaboration.names.axis_names.emplace(names[a], static_cast<int>(a));
}

void bind_metric(Elaboration& elaboration) {
  const auto line = written(elaboration);
  if (!line) return;
  if (elaboration.blocks.program) {
    elaboration.sink.report("not-allowed-here", line->range, {"coordinates", "a scene of a program"},
                            "the kernels of a program say what lengths are");
    return;
  }
  MetricBinder(elaboration, *line).bind();
}

void measure_sides(const Elaboration& elaboration, const std::string& name, std::vector<AxisSides>& boundary) {
  if (!elaboration.problem.metric) return;
  for (std::size_t axis = 0; axis < boundary.size(); ++axis) {
    const Expr& scale = elaboration.problem.metric->scales[axis];
    const Axis& along = elaboration.problem.axes[axis];
    for (Side* side : {&boundary[axis].low, &boundary[axis].high}) {
      const SideCondition& condition = condition_of(side->kind);
      if (condition.gives_slope()) side->value = binary(BinaryOp::multiply, side->value, scale, side->value->origin);
      if (condition.takes_rate()) side->value = binary(BinaryOp::divide, side->value, scale, side->value->origin);
      if (condition.b != SideCondition::Part::given) continue;
      const std::string place = side_name(along, side == &boundary[axis].low);
      bool varies = false;
      for (std::size_t other = 0; other < boundary.size(); ++other)
        varies = varies || (other != axis && depends_on_axis(scale, static_cast<int>(other)));
      if (varies)
        elaboration.sink.report(
            "in-curved-coordinates",
            boundary_of_side(elaboration, name, place).value_or(elaboration.blocks.scene->name.range),
            {"mixed on a wall along which lengths vary", elaboration.problem.metric->name},
            "take a value or gradient(g)");
      std::array<double, 3> wall{};
      wall[axis] = side == &boundary[axis].low ? along.low : along.high;
      if (!varies) side->b = binary(BinaryOp::divide, side->b, value_at(scale, wall), side->b->origin);
    }
  }
}

void check_poles(Elaboration& elaboration) { Poles(elaboration).check(); }

bool is_refused_in_curves(Elaboration& elaboration, const std::string& what, SourceRange range) {
  if (!elaboration.problem.metric) return false;
  elaboration.sink.report("in-curved-coordinates", range, {what, elaboration.problem.metric->name}, "");
  return true;
}

}  // namespace dpde::model
