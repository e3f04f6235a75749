// SPDX-License-Identifier: Apache-2.0
// Points between cells. inject(f, at = (x0, y0)) is a density; its sum over the cells times their volume is f. sample
// is the value of a field at a point. Both are expanded here into existing functions, so discretisation and
// differentiation need no extra rules. Formulas of coordinates are known at every placement: a hat function around cell
// centres becomes one around faces for values on faces.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/analyse/formula.h"
#include "model/boundary/metric.h"
#include "model/boundary/stretch.h"
#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/names/constants.h"
#include "model/from_ast/parts.h"
#include "model/from_ast/scene/coordinates.h"
#include "support/maths/comparisons.h"

namespace dpde::model {

namespace {

Expr larger(const Expr& a, const Expr& b) { return call(Fn::max, {a, b}); }
Expr smaller(const Expr& a, const Expr& b) { return call(Fn::min, {a, b}); }

/// hx, hy, hz: set by the grid of the run.
Expr spacing(int axis) { return param("h" + axis_name(axis)); }

}  // namespace

Expr place_after(const Axis& axis, int number_of_axis, double cells) {
  if (!axis.stretch) return plus(axis.low, times(cells, spacing(number_of_axis)));
  return at_place(axis.stretch->map,
                  smaller(plus(axis.low, times(cells, param(uniform_spacing_name(axis)))), axis.high));
}
Expr place_before(const Axis& axis, int number_of_axis, double cells) {
  if (!axis.stretch) return minus(axis.high, times(cells, spacing(number_of_axis)));
  return at_place(axis.stretch->map,
                  larger(minus(axis.high, times(cells, param(uniform_spacing_name(axis)))), axis.low));
}

namespace {

/// Weights of one source along the axes of a scene: for each cell a hat function that extends from the previous to the
/// next cell. Whether a position is before or after a cell is decided by comparing the same numbers for neighbouring
/// cells, so the weights of all cells add up to 1 and their derivatives by the position to 0. On a cell derivatives are
/// the right-hand ones, as for `interp`.
class Hats {
 public:
  explicit Hats(const Problem& problem) : problem_(problem) {
    const auto note = [&](const State& state) {
      for (std::size_t a = 0; a < 3; ++a) is_staggered_[a] = is_staggered_[a] || state.placement[a];
    };
    for (const State& state : problem.states) note(state);
  }

  /// The weight of a cell for a point at `position` along an axis. On a periodic axis the position is wrapped, and
  /// periodic images of the point count. Between walls the first and the last point that are not on walls take the
  /// whole weight beyond them.
  Expr along(int number_of_axis, const Expr& position) const {
    const Axis& axis = problem_.axes[static_cast<std::size_t>(number_of_axis)];
    if (axis.topology == Topology::periodic) {
      const double period = axis.high - axis.low;
      const Expr place = around(axis, position);
      const auto image = [&](double away) { return hat(number_of_axis, place, away, {}); };
      return plus(plus(image(0), image(period)), image(-period));
    }
    const Expr x = coordinate(number_of_axis);
    const auto at = [&](BinaryOp op, const Expr& limit) { return binary(op, x, limit); };
    const Expr is_first = at(BinaryOp::less, place_after(axis, number_of_axis, 1.25)),
               is_last = at(BinaryOp::greater, place_before(axis, number_of_axis, 1.25));
    const Expr share = hat(number_of_axis, position, 0, {is_first, is_last});
    if (!is_staggered_[static_cast<std::size_t>(number_of_axis)]) return share;
    const Expr is_wall = axis.holds_wall(true) ? at(BinaryOp::less, place_after(axis, number_of_axis, 0.25))
                                               : at(BinaryOp::greater, place_before(axis, number_of_axis, 0.25));
    return select(is_wall, 0.0, share);
  }
  Expr size(int number_of_axis) const {
    const Axis& axis = problem_.axes[static_cast<std::size_t>(number_of_axis)];
    return axis.stretch ? param(size_name(axis)) : spacing(number_of_axis);
  }

 private:
  /// The position wrapped onto the axis; unchanged if already there.
  static Expr around(const Axis& axis, const Expr& position) {
    const double period = axis.high - axis.low;
    const auto* fixed = as<Number>(position);
    if (fixed != nullptr && axis.low <= fixed->value && fixed->value < axis.high) return position;
    const Expr rounds = binary(BinaryOp::divide, minus(position, axis.low), period);
    const Expr is_there = binary(BinaryOp::logical_and, binary(BinaryOp::less_equal, axis.low, position),
                                 binary(BinaryOp::less, position, axis.high));
    return select(is_there, position, plus(axis.low, times(period, call(Fn::fraction, {rounds}))));
  }

  /// Between walls: whether the cell takes the whole weight below or above it.
  struct Beyond {
    std::optional<Expr> is_first, is_last;
  };

  /// For the cell's periodic image at distance `away`.
  Expr hat(int number_of_axis, const Expr& point, double away, const Beyond& beyond) const {
    const Expr here = shifted(coordinate(number_of_axis), away), before = neighbour(number_of_axis, -1, away),
               behind = neighbour(number_of_axis, +1, away);
    const bool is_even = !problem_.axes[static_cast<std::size_t>(number_of_axis)].stretch;
    const auto part = [&](const Expr& way, const Expr& of) {
      return binary(BinaryOp::divide, way, is_even ? spacing(number_of_axis) : of);
    };
    const auto is_below = [&](const Expr& x) { return binary(BinaryOp::less, point, x); };
    const Expr left = minus(1.0, part(minus(here, point), minus(here, before))),
               right = minus(1.0, part(minus(point, here), minus(behind, here)));
    Expr rising = select(is_below(before), 0.0, left), falling = select(is_below(behind), right, 0.0);
    if (beyond.is_first) rising = select(*beyond.is_first, 1.0, rising);
    if (beyond.is_last) falling = select(*beyond.is_last, 1.0, falling);
    return select(is_below(here), rising, falling);
  }
  static Expr shifted(const Expr& place, double away) { return away == 0 ? place : plus(place, away); }

  /// Position of the previous (-1) or next (+1) point, for an image at distance `away`. Coordinates wrap on periodic
  /// axes; going there and back gives the identical number.
  Expr neighbour(int number_of_axis, int cells, double away) const {
    const Axis& axis = problem_.axes[static_cast<std::size_t>(number_of_axis)];
    std::vector<int> offset(problem_.axes.size(), 0);
    offset[static_cast<std::size_t>(number_of_axis)] = cells;
    const Expr x = coordinate(number_of_axis), place = shift(x, std::move(offset));
    if (axis.topology == Topology::bounded) return place;
    const double period = axis.high - axis.low;
    const BinaryOp is_beside = cells < 0 ? BinaryOp::less : BinaryOp::greater;  // with one cell it is x itself
    return select(binary(is_beside, place, x), shifted(place, away),
                  shifted(place, cells < 0 ? away - period : away + period));
  }

  const Problem& problem_;
  std::array<bool, 3> is_staggered_{};
};

Expr sampled(const Problem& problem, Sample sample, std::size_t axis, const Origin& origin);

/// Interpolation ends half a cell beyond the centres. Next to the wall where the field has no values, it is written out
/// using the value on the wall itself.
Expr sampled_on_faces(const Problem& problem, Sample sample, std::size_t axis, const Origin& origin) {
  const Axis& along = problem.axes[axis];
  const int number_of_axis = static_cast<int>(axis);
  const bool is_low = !along.holds_wall(true);
  const Expr place = sample.place[axis];
  const Expr first = is_low ? minus(place_after(along, number_of_axis, 1), along.low)
                            : minus(along.high, place_before(along, number_of_axis, 1));
  const Expr way = is_low ? minus(place, along.low) : minus(along.high, place);
  const Expr share = larger(binary(BinaryOp::divide, way, first), 0.0);
  sample.place[axis] = is_low ? smaller(place, along.high) : larger(place, along.low);
  const auto taken = [&](InterpolationBasis what) {
    sample.along[axis] = what;
    return sampled(problem, sample, axis + 1, origin);
  };
  const Expr on_wall = times(minus(1.0, share), taken(is_low ? InterpolationBasis::lower : InterpolationBasis::upper)),
             inside = times(share, taken(is_low ? InterpolationBasis::upper : InterpolationBasis::lower));
  return select(binary(BinaryOp::less, share, 0.5), plus(on_wall, inside), taken(InterpolationBasis::linear));
}

/// Next to a wall with a slope, across a stretched axis. The ghost value has that slope over the map's cell width on
/// the wall, which differs from twice the distance between wall and centre. So the value is extrapolated from the
/// centre with the slope itself.
Expr sampled_beside_slopes(const Problem& problem, const AxisSides& sides, Sample sample, std::size_t axis,
                           const Origin& origin) {
  const Axis& along = problem.axes[axis];
  const int number_of_axis = static_cast<int>(axis);
  const Expr place = sample.place[axis], h = param(uniform_spacing_name(along)), slope = slope_of(along.stretch->map);
  const auto taken = [&](InterpolationBasis what) {
    sample.along[axis] = what;
    return sampled(problem, sample, axis + 1, origin);
  };
  Expr value = taken(InterpolationBasis::linear);
  if (condition_of(sides.low.kind).gives_slope()) {
    const Expr first = place_after(along, number_of_axis, 0.5);
    const Expr share = binary(BinaryOp::divide, minus(first, larger(place, along.low)),
                              times(h, value_at(slope, along.low)));  // weight of the ghost value
    value = select(binary(BinaryOp::less, place, first),
                   plus(times(share, taken(InterpolationBasis::lower)),
                        times(minus(1.0, share), taken(InterpolationBasis::upper))),
                   value);
  }
  if (condition_of(sides.high.kind).gives_slope()) {
    const Expr last = place_before(along, number_of_axis, 0.5);
    const Expr share =
        binary(BinaryOp::divide, minus(smaller(place, along.high), last), times(h, value_at(slope, along.high)));
    value = select(binary(BinaryOp::less, place, last), value,
                   plus(times(minus(1.0, share), taken(InterpolationBasis::lower)),
                        times(share, taken(InterpolationBasis::upper))));
  }
  return value;
}

/// The value of a field at a position along the axes from `axis` on.
Expr sampled(const Problem& problem, Sample sample, std::size_t axis, const Origin& origin) {
  if (axis == problem.axes.size()) return model::sample(std::move(sample), origin);
  const Axis& along = problem.axes[axis];
  const State* state = problem.find_state(sample.field);
  if (!state || along.topology == Topology::periodic) return sampled(problem, std::move(sample), axis + 1, origin);
  if (state->placement[axis]) return sampled_on_faces(problem, std::move(sample), axis, origin);
  const AxisSides& sides = state->boundary[axis];
  const bool has_slope = condition_of(sides.low.kind).gives_slope() || condition_of(sides.high.kind).gives_slope();
  if (along.stretch && has_slope) return sampled_beside_slopes(problem, sides, std::move(sample), axis, origin);
  return sampled(problem, std::move(sample), axis + 1, origin);
}

/// Evaluates a formula at a position. Fields are interpolated and coordinates are those of the position. An expression
/// of neighbours, as a derivative, is interpolated linearly between the points where the scheme has it: its sum over
/// the grid, weighted by hat functions. In curvilinear coordinates it is interpolated together with its metric factors,
/// without which a difference has no meaning.
class AtPoint {
 public:
  AtPoint(const Problem& problem, const std::vector<Expr>& place, Origin origin)
      : problem_(problem), place_(place), origin_(std::move(origin)) {}

  Expr operator()(const Expr& e) const {
    if (is_uniform(e)) return e;
    if (const auto* field = as<Field>(e)) return sampled(problem_, {field->name, place_}, 0, origin_);
    if (const auto* at = as<Coordinate>(e)) return place_[static_cast<std::size_t>(at->axis)];
    if (const auto* taken = as<Interpolate>(e)) return (*this)(taken->operand);
    if (const auto* neg = as<Neg>(e)) return negate((*this)(neg->operand), e->origin);
    const auto* b = as<Binary>(e);
    if (b != nullptr && !is_with_lengths(*b)) return binary(b->op, (*this)(b->left), (*this)(b->right), e->origin);
    if (const auto* c = as<Select>(e)) return select((*this)(c->condition), (*this)(c->yes), (*this)(c->no), e->origin);
    if (const auto* c = as<Call>(e)) {
      std::vector<Expr> arguments;
      for (const Expr& argument : c->arguments) arguments.push_back((*this)(argument));
      return call(c->fn, std::move(arguments), e->origin);
    }
    const auto* reduce = as<Reduce>(e);
    if (reduce && reduce->is_over_all()) return e;
    const Hats hats(problem_);
    Expr weight = 1.0;
    for (int axis = 0; axis < static_cast<int>(problem_.axes.size()); ++axis)
      weight = times(weight, hats.along(axis, place_[static_cast<std::size_t>(axis)]));
    return model::reduce(Reduce::Kind::sum, times(weight, e), e->origin);
  }

 private:
  /// A product or quotient of a difference and lengths.
  bool is_with_lengths(const Binary& b) const {
    const bool is_product = b.op == BinaryOp::multiply || b.op == BinaryOp::divide;
    if (!problem_.metric || !is_product || is_uniform(b.left) || is_uniform(b.right)) return false;
    const auto is_made_of_neighbours = [](const Expr& e) { return holds_any<Derivative, Advect>(e); };
    return is_made_of_neighbours(b.left) || is_made_of_neighbours(b.right);
  }

  const Problem& problem_;
  const std::vector<Expr>& place_;
  Origin origin_;
};

/// Whether the value of `e` is known when it is read: it has no t, no unknown and no parameter without a value.
bool is_known_now(const Elaboration& elaboration, const Expr& e) {
  return !any_part(e, [&](const Expr& part) {
    const auto* param = as<Param>(part);
    if (!param) return false;
    const auto value = elaboration.params.values.find(param->name);
    return elaboration.params.unknowns.contains(param->name) || value == elaboration.params.values.end() ||
           !value->second;
  });
}

/// Whether a part on faces along an axis with a pole is read in the cell next to the pole, as far as known.
bool is_beside_its_pole(const Elaboration& elaboration, const Expr& e, const std::vector<Expr>& place) {
  if (!is_on_pole(elaboration.problem, e)) return false;
  for (std::size_t a = 0; a < elaboration.problem.axes.size(); ++a) {
    const Axis& axis = elaboration.problem.axes[a];
    for (const bool is_low : {true, false}) {
      if (!is_pole_at(elaboration.problem, a, is_low)) continue;
      if (!is_known_now(elaboration, place[a])) return true;
      const double inside = axis.face(is_low != axis.runs_down() ? 1 : axis.cells - 1);
      const double there = value_of(place[a], elaboration.params.values).number;
      if (is_low ? there < inside : there > inside) return true;
    }
  }
  return false;
}

bool holds_sample(const Expr& e) { return holds_any<Sample>(e); }

}  // namespace

namespace {

/// A formula that is uniform in space as one number, from the first cell.
Expr in_first_cell(const Problem& problem, const Expr& e) {
  std::optional<Expr> first;
  for (int axis = 0; axis < static_cast<int>(problem.axes.size()); ++axis) {
    const Expr is_first = binary(BinaryOp::less, coordinate(axis), place_after(problem.axes[axis], axis, 1));
    first = first ? binary(BinaryOp::logical_and, *first, is_first) : is_first;
  }
  return reduce(Reduce::Kind::sum, select(*first, e, 0.0), e->origin);
}

}  // namespace

namespace formulas {

namespace {

std::optional<std::vector<Expr>> point(FormulaScope& here, const ast::Call& e) {
  if (!here.elaboration.problem.has_grid) {
    report_no_grid(here.elaboration, e.callee, e.callee_range);
    return std::nullopt;
  }
  if (e.arguments.size() != 2 || !e.arguments[0].name.empty() || e.arguments[1].name != "at") {
    here.elaboration.sink.report("wrong-argument-count", e.callee_range, {e.callee, "a formula and a place", "this"},
                                 here.axis_count() == 1 ? fmt::format("write {}(f, at = x0)", e.callee)
                                                        : fmt::format("write {}(f, at = (x0, y0{}))", e.callee,
                                                                      here.axis_count() == 3 ? ", z0" : ""));
    return std::nullopt;
  }
  const ast::Expr& place = e.arguments[1].value;
  const auto position = as_vector(here, any(here, place), place.range());
  if (!position) return std::nullopt;
  for (int axis = 0; axis < here.axis_count(); ++axis) {
    const Expr& along = (*position)[axis];
    const Axis& grid = here.elaboration.problem.axes[axis];
    if (!is_uniform(along) || holds_sample(along)) {
      const char* const what = is_uniform(along) ? "the value of a field" : "a value that differs from cell to cell";
      here.elaboration.sink.report("not-allowed-here", place.range(), {what, "the place of a point"},
                                   "a place is made of numbers, parameters and t");
      return std::nullopt;
    }
    if (!is_known_now(here.elaboration, along)) continue;
    const Value value = value_of(along, here.elaboration.params.values);
    const bool is_around = grid.topology == Topology::periodic && std::isfinite(value.number);  // positions wrap
    if (value.mistake.empty() && is_around) continue;
    if (value.mistake.empty() && value.number >= grid.low && value.number <= grid.high) continue;
    here.elaboration.sink.report("outside-the-grid", place.range(),
                                 {e.callee, fmt::format("{} = {}", grid.name, value.number)},
                                 fmt::format("axis {} reaches from {} to {}", grid.name, grid.low, grid.high));
    return std::nullopt;
  }
  if (!std::ranges::all_of(*position, [&](const Expr& along) { return is_known_now(here.elaboration, along); }))
    here.elaboration.open_places.push_back({e.callee, *position, place.range()});
  return position;
}

}  // namespace

TypedExpr injection(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (!here.is_of_step()) return refuse(here, "the point source inject", e.callee_range);
  const auto position = point(here, e);
  const auto strength = e.arguments.empty()
                            ? std::nullopt
                            : as_number(here, any(here, e.arguments[0].value), e.arguments[0].value.range());
  if (!position || !strength) return {};
  const Hats hats(here.elaboration.problem);
  Expr volume = 1.0;
  Expr weight = 1.0;
  for (int axis = 0; axis < here.axis_count(); ++axis) {
    weight = times(weight, hats.along(axis, (*position)[axis]));
    volume = times(volume, hats.size(axis));
  }
  const Expr density = binary(BinaryOp::divide, times(*strength, weight), volume, {range});
  return number_of(Coordinates(here.elaboration.problem, {range}).per_volume(density));
}

TypedExpr sampling(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (here.context == FormulaContext::equation) {
    here.elaboration.sink.report("not-allowed-here", e.callee_range,
                                 {"the point value sample", std::string(place_of(here.context))},
                                 "read it into a field, after step: s = sample(...), and use s");
    return {};
  }
  if (here.context != FormulaContext::quantity && here.context != FormulaContext::event)
    return refuse(here, "the point value sample", e.callee_range);
  const auto position = point(here, e);
  if (!position) return {};
  TypedExpr value = numeric(here, e.arguments[0].value);
  for (const Expr& part : value.parts) {
    if (!is_beside_its_pole(here.elaboration, part, *position)) continue;
    here.elaboration.sink.report(
        "beside-pole", range, {"a value sampled from faces on the pole"},
        "there it is 0, whatever flows over the pole: leave `on faces` out, or stay a cell away");
    break;
  }
  const AtPoint at_point(here.elaboration.problem, *position, {range});
  for (Expr& part : value.parts) part = at_point(part);
  return value;
}

}  // namespace formulas

bool can_be_series(const Elaboration& elaboration, const std::string& field) {
  if (!elaboration.problem.task) return false;
  const auto datum = std::ranges::find(elaboration.problem.task->data, field, &Datum::name);
  return datum != elaboration.problem.task->data.end() &&
         (datum->series || (!datum->file.empty() && !datum->trajectories));
}

bool mark_as_series(Elaboration& elaboration, const std::string& field) {
  if (!can_be_series(elaboration, field)) return false;
  return std::ranges::find(elaboration.problem.task->data, field, &Datum::name)->series = true;
}

Expr with_points_as_numbers(const Problem& problem, const Expr& e) {
  if (!holds_sample(e) || is<Reduce>(e)) return e;
  const bool is_at_point = !holds_any<Reduce>(e) && !holds_any<Coordinate, Field>(e);
  if (is_at_point && !is_condition(e)) return in_first_cell(problem, e);
  return map_children(e, [&](const Expr& part) { return with_points_as_numbers(problem, part); });
}

Expr over_one_cell(Elaboration& elaboration, const Expr& e) {
  if (const auto* neg = as<Neg>(e)) return negate(over_one_cell(elaboration, neg->operand), e->origin);
  if (holds_any<Reduce>(e)) {
    const auto* b = as<Binary>(e);
    if (!b) return e;
    return binary(b->op, over_one_cell(elaboration, b->left), over_one_cell(elaboration, b->right), e->origin);
  }
  if (!holds_sample(e)) return e;
  const bool at_a_point = !any_part(e, [&](const Expr& part) {
    const auto* field = as<Field>(part);
    return is<Coordinate>(part) || (field && !mark_as_series(elaboration, field->name));
  });
  return at_a_point ? in_first_cell(elaboration.problem, e) : e;
}

}  // namespace dpde::model
