// SPDX-License-Identifier: Apache-2.0
#include "stencil/space/departure.h"

#include <algorithm>

#include "model/build.h"
#include "stencil/build.h"

namespace dpde::stencil {

const model::Advect* find_transport(const model::Expr& rate) {
  for (const model::Term& term : model::terms_of(rate)) {
    const auto* advect = as<model::Advect>(term.value);
    if (advect) return advect;  // lives as long as the equation
  }
  return nullptr;
}

std::vector<Expr> Departure::way(const model::Advect& advect, bool backwards) {
  std::vector<Expr> result;
  for (int axis = 0; axis < static_cast<int>(advect.velocity.size()); ++axis) {
    const Expr cells = param("dt") * at_point_.velocity(advect.velocity[axis], state_.placement) / spacing(axis);
    result.push_back(backwards ? -cells : cells);
  }
  return result;
}

std::vector<Expr> Departure::shared_way(const std::string& wish, std::vector<Expr> way) {
  for (std::size_t axis = 0; axis < way.size(); ++axis)
    way[axis] = at_point_.shared(wish + "_" + axis_letter(static_cast<int>(axis)), way[axis]);
  return way;
}

bool Departure::lies_on_walls(std::size_t axis) const {
  return state_.placement[axis] && problem_.axes[axis].topology == Topology::bounded;
}

Expr Departure::place(std::size_t axis) const {
  const Expr centre = access(axis_letter(static_cast<int>(axis)));
  return state_.placement[axis] ? centre + spacing(static_cast<int>(axis)) / 2.0 : centre;
}

std::vector<Expr> Departure::ended(std::vector<Expr> way) {
  for (std::size_t axis = 0; axis < way.size(); ++axis) {
    if (!lies_on_walls(axis)) continue;
    const Expr h = spacing(static_cast<int>(axis)), here = place(axis);
    const Expr to_low = (problem_.axes[axis].low - here) / h, to_high = (problem_.axes[axis].high - here) / h;
    way[axis] = at_point_.shared("ended_" + axis_letter(static_cast<int>(axis)),
                                 call(Fn::min, {call(Fn::max, {way[axis], to_low}), to_high}));
  }
  return way;
}

Expr Departure::taken(const std::string& field, const std::vector<Expr>& way, InterpolationBasis along) {
  Interp read{field, {}, ended(way), {}};
  std::fill_n(read.along.begin(), way.size(), along);
  return between(std::move(read), 0);
}

/// interp ends half a cell beyond the first point inside. For states on walls the interpolation is therefore built
/// here: (1 - f)*u[j] + f*u[j+1], with j = -1 the low wall and f the distance from j. If j is the wall, f is measured
/// from the wall, so that rounding cannot move it to the other side.
Expr Departure::between(Interp read, std::size_t axis) {
  if (axis == read.displacement.size()) return interp(std::move(read));
  if (!lies_on_walls(axis)) return between(std::move(read), axis + 1);
  if (read.along[axis] == InterpolationBasis::cubic) return cubic_between(std::move(read), axis);
  const Expr way = read.displacement[axis],
             from_wall = way + (place(axis) - problem_.axes[axis].low) / spacing(static_cast<int>(axis));
  const Expr beyond =
      at_point_.shared("beyond_" + axis_letter(static_cast<int>(axis)),
                       select(binary(BinaryOp::less, from_wall, 0.5), from_wall, call(Fn::fraction, {way})));
  read.along[axis] = InterpolationBasis::lower;
  const Expr lower = between(read, axis + 1);
  read.along[axis] = InterpolationBasis::upper;
  return (1.0 - beyond) * lower + beyond * between(std::move(read), axis + 1);
}

/// Within one and a half cells from a wall, uses the polynomial through the four points next to the wall, including the
/// one on it, at -1, 0, 1 and 2; `at` is the point of evaluation. They are read from midway between the inner two.
Expr Departure::cubic_between(Interp read, std::size_t axis) {
  const Expr way = read.displacement[axis], h = spacing(static_cast<int>(axis)), here = place(axis);
  const Expr low = (here - problem_.axes[axis].low) / h, high = (problem_.axes[axis].high - here) / h;
  const std::string letter = axis_letter(static_cast<int>(axis));
  const Expr from_low = at_point_.shared("from_low_" + letter, way + low),
             from_high = at_point_.shared("from_high_" + letter, high - way);
  const auto beside = [&](const Expr& middle, const Expr& at) {
    const auto point = [&](const Expr& displacement, InterpolationBasis side) {
      Interp one = read;
      one.displacement[axis] = displacement;
      one.along[axis] = side;
      return between(std::move(one), axis + 1);
    };
    const Expr first = point(middle - 1.0, InterpolationBasis::lower),
               last = point(middle + 1.0, InterpolationBasis::upper);
    const Expr second = point(middle, InterpolationBasis::lower), third = point(middle, InterpolationBasis::upper);
    const Expr before = at + 1.0, next = 1.0 - at, after = 2.0 - at;
    const Expr inner = before * after / 2.0, outer = at * next / 6.0;
    return inner * (next * second + at * third) - outer * (after * first + before * last);
  };
  const Expr at_low = beside(1.5 - low, at_point_.shared("beyond_" + letter, from_low - 1.0)),
             at_high = beside(high - 1.5, at_point_.shared("beyond_" + letter, 2.0 - from_high));
  return select(binary(BinaryOp::less, from_low, 1.5), at_low,
                select(binary(BinaryOp::less, from_high, 1.5), at_high, between(std::move(read), axis + 1)));
}

Bounds Departure::bounds(const std::string& field, const std::vector<Expr>& way) {
  const std::vector<Expr> to = ended(way);
  std::optional<Bounds> bounds;
  for (int corner = 0; corner < 1 << to.size(); ++corner) {
    Interp read{field, {}, to, {}};
    for (std::size_t axis = 0; axis < to.size(); ++axis)
      read.along[axis] = corner >> axis & 1 ? InterpolationBasis::upper : InterpolationBasis::lower;
    const Expr value = at_point_.shared(field + "_corner", interp(read));
    if (!bounds) {
      bounds = {value, value};
      continue;
    }
    bounds = {at_point_.shared(field + "_least", call(Fn::min, {bounds->least, value})),
              at_point_.shared(field + "_greatest", call(Fn::max, {bounds->greatest, value}))};
  }
  return *bounds;
}

Expr Departure::within_walls(Expr value, const std::vector<Expr>& back, const std::vector<Expr>& forth) {
  for (std::size_t axis = 0; axis < problem_.axes.size(); ++axis) {
    if (problem_.axes[axis].topology == Topology::periodic) continue;
    const Expr here = place(axis), low = here - problem_.axes[axis].low, high = problem_.axes[axis].high - here;
    const Expr room = call(Fn::min, {low, high}) / spacing(static_cast<int>(axis));
    const Expr longest = call(Fn::max, {call(Fn::abs, {back[axis]}), call(Fn::abs, {forth[axis]})});
    value = select(binary(BinaryOp::less_equal, longest, room), value, 0.0);
  }
  return value;
}

}  // namespace dpde::stencil
