// SPDX-License-Identifier: Apache-2.0
#include "model/from_ast/scene/coordinates.h"

#include "model/analyse/formula.h"
#include "model/boundary/metric.h"
#include "model/build.h"

namespace dpde::model {

Expr Coordinates::times(const Expr& a, const Expr& b) const { return binary(BinaryOp::multiply, a, b, origin_); }
Expr Coordinates::over(const Expr& a, const Expr& b) const { return binary(BinaryOp::divide, a, b, origin_); }
Expr Coordinates::d(const Expr& e, int axis) const { return derivative(e, axis, 1, origin_); }

Expr Coordinates::scale(int axis) const {
  return problem_.metric ? problem_.metric->scales[static_cast<std::size_t>(axis)] : Expr(1.0);
}

Expr Coordinates::face(int axis) const {
  Expr face = 1.0;
  if (!problem_.metric) return face;
  for (int other = 0; other < axes(); ++other) {
    if (other != axis && depends_on_axis(scale(other), axis)) face = times(face, scale(other));
  }
  return depends_on_axis(problem_.metric->around, axis) ? times(face, problem_.metric->around) : face;
}

Expr Coordinates::outflow(const Expr& flux, int axis) const {
  const Expr across = face(axis);
  return over(d(times(across, flux), axis), times(scale(axis), across));
}

Expr Coordinates::on_faces(const Expr& component, int axis) const {
  const bool has_slope = any_part(component, [&](const Expr& part) {
    const auto* slope = as<Derivative>(part);
    return slope != nullptr && slope->axis == axis;
  });
  const std::optional<Placement> own = placements_.natural(component);
  const bool is_there = has_slope || (own && (*own)[static_cast<std::size_t>(axis)]);
  return is_there ? component : interpolate(component, origin_);
}

Expr Coordinates::slope(const Expr& f, int axis) const { return over(d(f, axis), scale(axis)); }

/// Uses the compact second difference if the lengths allow it.
Expr Coordinates::diffusion(const Expr& f, int axis) const {
  const Expr h = scale(axis), across = face(axis);
  if (depends_on_axis(h, axis)) return outflow(slope(f, axis), axis);
  const bool is_plain = is_literal(across, 1);
  const Expr bend = is_plain ? derivative(f, axis, 2, origin_) : d(times(across, d(f, axis)), axis);
  return over(bend, times(times(h, h), across));
}

Expr Coordinates::laplacian(const Expr& f) const {
  Expr sum = diffusion(f, 0);
  for (int axis = 1; axis < axes(); ++axis) sum = binary(BinaryOp::add, sum, diffusion(f, axis), origin_);
  return sum;
}

Expr Coordinates::divergence(const std::vector<Expr>& v) const {
  Expr sum = 0.0;
  for (int axis = 0; axis < axes(); ++axis) {
    const Expr& along = v[static_cast<std::size_t>(axis)];
    const bool is_plain = is_literal(face(axis), 1);
    const Expr out = outflow(is_plain ? along : on_faces(along, axis), axis);
    sum = axis == 0 ? out : binary(BinaryOp::add, sum, out, origin_);
  }
  return sum;
}

Expr Coordinates::turn_of(const Expr& component, int a, int b) const {
  const Expr h = scale(a);
  if (!depends_on_axis(h, b)) return over(d(component, b), scale(b));
  return over(d(times(h, on_faces(component, b)), b), times(h, scale(b)));
}

/// At a pole the rotation is twice the slope of the mean velocity around it, which grows linearly with the distance.
Expr Coordinates::rotation(const std::vector<Expr>& v, int a, int b) const {
  const auto part = [&](int by, int of) { return turn_of(v[static_cast<std::size_t>(of)], of, by); };
  const auto difference = [&](const Expr& x, const Expr& y) { return binary(BinaryOp::subtract, x, y, origin_); };
  Expr turn = difference(part(a, b), part(b, a));
  for (const auto& [across, around] : {std::array{a, b}, std::array{b, a}}) {
    const auto to = static_cast<std::size_t>(across), along = static_cast<std::size_t>(around);
    const std::optional<Placement> place = placements_.natural(v[to]);
    const bool is_on_pole = place && (*place)[to] &&
                            (is_pole_at(problem_, to, true) || is_pole_at(problem_, to, false)) &&
                            depends_on_axis(scale(around), across);
    if (!is_on_pole) continue;
    Reduce mean{Reduce::Kind::mean, v[along], {}};
    mean.over[along] = true;
    const Expr slope = times(2.0, over(d(model::reduce(mean, origin_), across), scale(across)));
    const Expr is_inside = binary(BinaryOp::greater, scale(around), length_of_poles(problem_, to, along), origin_);
    turn = model::select(is_inside, turn, across == b ? negate(slope, origin_) : slope);  // internal switch
  }
  return turn;
}

/// On one axis faces and nodes coincide: a component there counts as one on faces.
bool Coordinates::is_spread(const std::vector<Expr>& v) const {
  if (!placements_.is_staggered()) return false;
  std::optional<Placement> first;
  for (const Expr& part : v) {
    const std::optional<Placement> place = placements_.natural(part);
    if (place && first && *place != *first) return true;
    if (place) first = place;
  }
  return axes() == 1 && first && *first != Placement{};
}

Expr Coordinates::dot(const std::vector<Expr>& a, const std::vector<Expr>& b) const {
  Expr sum = 0.0, at_centres = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Expr product = times(a[i], b[i]);
    sum = binary(BinaryOp::add, sum, product, origin_);
    const Expr spread = per_volume(interpolate(times_volume(product), origin_));
    at_centres = binary(BinaryOp::add, at_centres, spread, origin_);
  }
  return is_spread(a) || is_spread(b) ? at_centres : sum;
}

Expr Coordinates::carried(const Expr& s, const Expr& across, bool has_s_inside) const {
  const auto there = [&](const Expr& e) { return interpolate(e, origin_); };
  const auto own = placements_.natural(s), of_flux = placements_.natural(across);
  if (own == of_flux || !of_flux) return times(s, across);
  if (!own) return has_s_inside ? there(times(s, across)) : times(s, there(across));
  const Expr apart = times(there(s), there(across)), at_flux = there(times(across, there(s))),
             at_nodes = there(times(s, there(across)));
  const Expr both = times(2.0, binary(BinaryOp::add, apart, at_flux, origin_));
  return over(binary(BinaryOp::subtract, both, at_nodes, origin_), 3.0);
}

std::vector<Expr> Coordinates::cross(const Expr& s, const std::vector<Expr>& v) const {
  const Expr first = over(carried(s, times(scale(0), v[1]), true), scale(0));
  const Expr second = over(carried(s, times(scale(1), v[0]), false), scale(1));
  return {negate(first, origin_), second};
}

std::vector<Expr> Coordinates::speeds(std::vector<Expr> v) const {
  for (int axis = 0; axis < axes(); ++axis)
    v[static_cast<std::size_t>(axis)] = over(v[static_cast<std::size_t>(axis)], scale(axis));
  return v;
}

std::vector<Expr> Coordinates::advection(const std::vector<Expr>& v, const std::vector<Expr>& f) const {
  std::vector<Expr> result;
  for (int i = 0; i < static_cast<int>(f.size()); ++i) {
    const Expr& along = f[static_cast<std::size_t>(i)];
    Expr sum = advect(speeds(v), along, origin_);
    if (!problem_.metric || f.size() != problem_.axes.size() || axes() == 1) {
      result.push_back(sum);
      continue;
    }
    const auto home = placements_.natural(along);
    const auto there = [&](const Expr& e) { return beside(e, home); };
    const auto part = [&](int of) { return there(v[static_cast<std::size_t>(of)]); };
    for (int j = 0; j < axes(); ++j) {
      if (j == i) continue;
      const Expr turn = binary(BinaryOp::subtract, times(part(i), slope_of(scale(i), {j})),
                               times(part(j), slope_of(scale(j), {i})), origin_);
      const Expr bent = over(times(there(f[static_cast<std::size_t>(j)]), turn), times(scale(i), scale(j)));
      sum = binary(BinaryOp::add, sum, bent, origin_);
    }
    result.push_back(sum);
  }
  return result;
}

Expr Coordinates::beside(const Expr& e, const std::optional<Placement>& home) const {
  return placements_.natural(e) == home ? e : interpolate(e, origin_);
}

Expr Coordinates::turned(const Expr& f, int of, int by) const {
  return over(times(f, slope_of(scale(of), {by})), times(scale(of), scale(by)));
}

std::vector<Expr> Coordinates::vector_gradient(const std::vector<Expr>& v) const {
  std::vector<Expr> parts;
  for (int i = 0; i < axes(); ++i) {
    for (int j = 0; j < axes(); ++j) {
      const auto along = [&](int of) { return v[static_cast<std::size_t>(of)]; };
      Expr part = slope(along(i), j);
      const auto home = placements_.natural(part);
      if (problem_.metric && i != j)
        part = binary(BinaryOp::subtract, part, turned(beside(along(j), home), j, i), origin_);
      for (int k = 0; problem_.metric && i == j && k < axes(); ++k) {
        if (k != i) part = binary(BinaryOp::add, part, turned(beside(along(k), home), i, k), origin_);
      }
      parts.push_back(part);
    }
  }
  return parts;
}

std::vector<Expr> Coordinates::tensor_divergence(const std::vector<Expr>& s) const {
  std::vector<Expr> parts;
  const auto entry = [&](int i, int j) { return s[static_cast<std::size_t>(i * axes() + j)]; };
  for (int i = 0; i < axes(); ++i) {
    const auto begin = s.begin() + i * axes();
    Expr part = divergence({begin, begin + axes()});
    const auto home = placements_.natural(part);
    for (int j = 0; problem_.metric && j < axes(); ++j) {
      if (j == i) continue;
      part = binary(BinaryOp::add, part, turned(beside(entry(j, i), home), i, j), origin_);
      part = binary(BinaryOp::subtract, part, turned(beside(entry(j, j), home), j, i), origin_);
    }
    parts.push_back(part);
  }
  return parts;
}

std::vector<Expr> Coordinates::vector_laplacian(const std::vector<Expr>& f) const {
  if (!problem_.metric) {
    std::vector<Expr> parts;
    for (const Expr& part : f) parts.push_back(laplacian(part));
    return parts;
  }
  const std::array<Expr, 2> turns{negate(over(slope_of(scale(0), {1}), scale(1)), origin_),
                                  over(slope_of(scale(1), {0}), scale(0))};
  const auto component = [&](const Expr& own, const Expr& other, bool is_first) {
    const BinaryOp minus = is_first ? BinaryOp::subtract : BinaryOp::add,
                   plus = is_first ? BinaryOp::add : BinaryOp::subtract;
    Expr sum = 0.0;
    for (int axis = 0; axis < 2; ++axis) {
      const Expr turn = turns[static_cast<std::size_t>(axis)], h = scale(axis);
      if (is_literal(turn, 0)) {
        sum = binary(BinaryOp::add, sum, diffusion(own, axis), origin_);
        continue;
      }
      const Expr flux = over(binary(minus, d(own, axis), times(turn, other), origin_), h);
      // At order 2 the other flux is averaged over both faces, as then D_j applied twice to a constant vector is as
      // small as its square: near a pole the remainder is divided by r^2
      const Expr spacing = param("h" + problem_.axes[static_cast<std::size_t>(axis)].name, origin_);
      const Expr bend = times(over(times(spacing, spacing), 4.0), derivative(own, axis, 2, origin_));
      const Expr beside = problem_.scheme.derivative_order > 2 ? own : binary(BinaryOp::add, own, bend, origin_);
      const Expr turned = times(over(turn, times(h, h)), binary(plus, d(other, axis), times(turn, beside), origin_));
      sum = binary(BinaryOp::add, sum, binary(minus, outflow(flux, axis), turned, origin_), origin_);
    }
    return sum;
  };
  return {component(f[0], f[1], true), component(f[1], f[0], false)};
}

Expr Coordinates::per_area(const Expr& bracket) const { return over(bracket, times(scale(0), scale(1))); }
Expr Coordinates::per_volume(const Expr& e) const { return problem_.metric ? over(e, volume_of(*problem_.metric)) : e; }
Expr Coordinates::times_volume(const Expr& e) const {
  return problem_.metric ? times(e, volume_of(*problem_.metric)) : e;
}

/// The mean of 1 is 1 to rounding. Sums, largest and smallest values count each cell once.
Expr Coordinates::reduction(const Reduce& reduce) const {
  const bool is_weighed = reduce.reduction == Reduce::Kind::mean || reduce.reduction == Reduce::Kind::integral;
  if (!problem_.metric || !is_weighed) return model::reduce(reduce, origin_);
  const Expr size =
      reduce.is_over_all() ? volume_of(*problem_.metric) : size_of(*problem_.metric, reduce.over, problem_.axes.size());
  Reduce weighed = reduce;
  weighed.operand = times(reduce.operand, size);
  if (reduce.reduction == Reduce::Kind::integral) return model::reduce(std::move(weighed), origin_);
  bool varies = false, varies_beside = false;
  for (int axis = 0; axis < axes(); ++axis) {
    bool& found = reduce.over[static_cast<std::size_t>(axis)] ? varies : varies_beside;
    found = found || depends_on_axis(size, axis);
  }
  if (!varies) return model::reduce(reduce, origin_);
  const Expr sum = model::reduce(std::move(weighed), origin_);
  if (varies_beside) return over(sum, model::reduce(Reduce{Reduce::Kind::mean, size, reduce.over}, origin_));
  const Placement place = placements_.natural(reduce.operand).value_or(Placement{});
  return times(1 / mean_of(size, problem_.axes, place), sum);
}

}  // namespace dpde::model
