// SPDX-License-Identifier: Apache-2.0
#include "model/boundary/stretch.h"

#include <algorithm>
#include <utility>

#include "model/analyse/formula.h"
#include "model/analyse/placement.h"
#include "model/build.h"
#include "model/rewrite.h"
#include "support/match.h"

namespace dpde::model {

bool is_taken(const Problem& problem, const std::string& name) {
  const auto is_datum = [&](const Datum& datum) { return datum.name == name; };
  const auto is_test = [&](const Test& test) { return test.quantity.name == name; };
  return problem.find_state(name) || problem.find_coefficient(name) || problem.find_param(name) ||
         problem.find_network(name) || problem.find_shown(name) ||
         std::ranges::any_of(problem.observables,
                             [&](const Quantity& observable) { return observable.name == name; }) ||
         (problem.task &&
          (std::ranges::any_of(problem.task->data, is_datum) || std::ranges::any_of(problem.task->tests, is_test)));
}

namespace {

Expr metric_of(const Stretch& stretch) { return over(1.0, slope_of(stretch.map)); }

/// 1 over the mean slope, at the centres or at the upper faces of the cells.
double normalisation(const Axis& axis, const Expr& slope, bool on_faces) {
  double sum = 0;
  for (int i = 0; i < axis.cells; ++i) sum += value_at(slope, axis.low + (i + (on_faces ? 1.0 : 0.5)) * axis.spacing());
  return axis.cells / sum;
}

class StretchRewriter {
 public:
  explicit StretchRewriter(const Problem& problem) : problem_(problem), placements_(problem) {
    for (const Axis& axis : problem.axes) {
      slopes_.push_back(axis.stretch ? std::optional(slope_of(axis.stretch->map)) : std::nullopt);
      names_.push_back(axis.name + "_metric");
      while (is_taken(problem, names_.back())) names_.back() += "_";
    }
    is_read_.resize(problem.axes.size());
  }

  Expr operator()(const Expr& e);
  /// Sides of a field at this placement.
  void rewrite(AxisSides& sides, int axis, const Placement& home);
  /// The following formulas are those of a field at this placement.
  void begin(const Placement& home) { home_ = home; }
  /// The metric coefficients that were used so far.
  std::vector<Coefficient> metrics() const;

 private:
  bool is_stretched(int axis) const { return slopes_[static_cast<std::size_t>(axis)].has_value(); }
  std::vector<Expr> all(std::vector<Expr> parts) {
    for (Expr& part : parts) part = (*this)(part);
    return parts;
  }
  Expr metric(int axis) {
    const auto a = static_cast<std::size_t>(axis);
    is_read_[a] = true;
    return placements_.is_staggered() ? interpolate(field(names_[a])) : field(names_[a]);
  }
  double slope_at(int axis, double s) const { return value_at(*slopes_[static_cast<std::size_t>(axis)], s); }
  double metric_beside(int axis, bool is_low) const;
  Expr over_volume(Expr e);
  Expr spacing_or(const Param& p, const Expr& e);
  Expr derivative_of(const Derivative& d, Origin origin);
  Expr advection_of(const Advect& a, Origin origin);
  Expr weighted(const Reduce& r, Origin origin);
  Expr size_along(int axis);
  Expr sampled(Sample sample, Origin origin);
  double norm(std::size_t axis, bool on_faces) const {
    return normalisation(problem_.axes[axis], *slopes_[axis], on_faces);
  }

  const Problem& problem_;
  const Placements placements_;
  std::vector<std::optional<Expr>> slopes_;  // one per axis; nullopt for a uniform axis
  std::vector<std::string> names_;
  std::vector<bool> is_read_;
  Placement home_{};
};

/// The fraction of the interval from `from` to `to` below x. At the ends its slope is the right-hand one.
Expr share_before(const Expr& x, const Expr& from, const Expr& to) {
  const Expr share = over(binary(BinaryOp::subtract, x, from), binary(BinaryOp::subtract, to, from));
  return call(Fn::min, {call(Fn::max, {share, 0.0}), 1.0});
}

/// The uniform coordinate s of a position x. Between the points of a field s is linear in x, as the field itself is. s
/// is the sum over all cells of the part of each that lies below x.
class UniformPlace {
 public:
  UniformPlace(const Axis& axis, int number, bool on_faces) : axis_(axis), number_(number), on_faces_(on_faces) {}

  Expr of(const Expr& x) const {
    if (!holds_any<Param>(x)) return number_of(value_at(x, 0));
    Reduce sum{Reduce::Kind::sum, part(x, param("h" + axis_.name)), {}};
    sum.over[static_cast<std::size_t>(number_)] = true;
    return binary(BinaryOp::add, begin(param("h" + axis_.name)), reduce(std::move(sum)));
  }

 private:
  bool is_periodic() const { return axis_.topology == Topology::periodic; }
  /// s at the point where the sum begins.
  Expr begin(const Expr& h) const {
    return is_periodic() && !on_faces_ ? binary(BinaryOp::subtract, axis_.low, over(h, 2.0)) : Expr(axis_.low);
  }
  Expr within(const Expr& x) const {
    if (!is_periodic()) return x;
    const double period = axis_.high - axis_.low;
    return binary(BinaryOp::add, axis_.low,
                  times(period, call(Fn::fraction, {over(binary(BinaryOp::subtract, x, axis_.low), period)})));
  }
  /// The contribution of a cell, for spacing h.
  Expr part(const Expr& given, const Expr& h) const {
    const Expr s = coordinate(number_), x = within(given), half = over(h, 2.0);
    const auto place = [&](const Expr& at) { return at_place(axis_.stretch->map, at); };
    const Expr before_half = binary(BinaryOp::subtract, s, half), after_half = binary(BinaryOp::add, s, half);
    if (on_faces_) return times(h, share_before(x, place(before_half), place(after_half)));
    const Expr before = times(h, share_before(x, place(binary(BinaryOp::subtract, s, h)), place(s)));
    const Expr is_first = binary(BinaryOp::less, s, binary(BinaryOp::add, axis_.low, h)),
               is_last = binary(BinaryOp::greater, s, binary(BinaryOp::subtract, axis_.high, h));
    if (is_periodic())
      return binary(BinaryOp::add, before,
                    select(is_last, times(h, share_before(x, place(s), place(binary(BinaryOp::add, s, h)))), 0.0));
    const Expr first = times(half, share_before(x, axis_.low, place(s))),
               end = times(half, share_before(x, place(s), axis_.high));
    return binary(BinaryOp::add, select(is_first, first, before), select(is_last, end, 0.0));
  }
  /// The same for positions made of numbers and parameters.
  double number_of(double x) const {
    double s = value_at(begin(axis_.spacing()), 0);
    const Expr formula = part(x, axis_.spacing());
    for (int i = 0; i < axis_.cells; ++i) s += value_at(formula, axis_.low + (i + 0.5) * axis_.spacing());
    return s;
  }

  const Axis& axis_;
  int number_;
  bool on_faces_;
};

Expr StretchRewriter::operator()(const Expr& e) {
  const Origin origin = e->origin;
  return match(
      e->kind, [&](const Number&) { return e; }, [&](const Field&) { return e; }, [&](const Noise&) { return e; },
      [&](const Sample& s) { return sampled(s, origin); }, [&](const Param& p) { return spacing_or(p, e); },
      [&](const Coordinate& c) {
        return is_stretched(c.axis) ? problem_.axes[static_cast<std::size_t>(c.axis)].stretch->map : e;
      },
      [&](const Neg& n) { return negate((*this)(n.operand), origin); },
      [&](const Binary& b) {
        const Expr left = (*this)(b.left);
        return binary(b.op, left, (*this)(b.right), origin);
      },
      [&](const Call& c) { return call(c.fn, all(c.arguments), origin); },
      [&](const Select& s) {
        const Expr condition = (*this)(s.condition), yes = (*this)(s.yes);
        return select(condition, yes, (*this)(s.no), origin);
      },
      [&](const Derivative& d) { return derivative_of(d, origin); },
      [&](const Advect& a) { return advection_of(a, origin); },
      [&](const Shift& s) { return shift((*this)(s.operand), s.offset, origin); },
      [&](const Interpolate& i) { return interpolate((*this)(i.operand), origin); },
      [&](const BandPass& b) {
        return band_pass({(*this)(b.operand), b.first, b.last, b.unit}, origin);
      },
      [&](const Reduce& r) { return weighted(r, origin); },
      [&](const Apply& a) {
        Operator function = a.function;  // of coordinates only: other operators are not allowed on stretched axes
        function.body = all(function.body);
        return apply({std::move(function), all(a.arguments), a.component, a.places, a.results}, origin);
      },
      [&](const NetworkCall& i) {
        return network_call({i.network, all(i.arguments), i.output, i.outputs, i.name}, origin);
      },
      [&](const Solve& s) {
        Solve rewritten = s;
        rewritten.operation = over_volume((*this)(s.operation));
        rewritten.right = over_volume((*this)(s.right));
        rewritten.starts = all(s.starts);
        if (s.preconditioner) rewritten.preconditioner = (*this)(*s.preconditioner);
        for (std::size_t axis = 0; axis < s.boundary.size(); ++axis)
          rewrite(rewritten.boundary[axis], static_cast<int>(axis), {});
        return solve(std::move(rewritten), origin);
      });
}

/// Multiplies by the cell volume in uniform coordinates: a flux then has the same weight in both its cells, and a
/// symmetric operator stays symmetric.
Expr StretchRewriter::over_volume(Expr e) {
  for (int axis = 0; axis < static_cast<int>(slopes_.size()); ++axis) {
    if (is_stretched(axis)) e = over(e, metric(axis), e->origin);
  }
  return e;
}

Expr StretchRewriter::spacing_or(const Param& p, const Expr& e) {
  for (int axis = 0; axis < static_cast<int>(slopes_.size()); ++axis) {
    if (!is_stretched(axis)) continue;
    const Axis& along = problem_.axes[static_cast<std::size_t>(axis)];
    if (p.name == "h" + along.name) return over(e, metric(axis), e->origin);
    if (p.name == size_name(along)) return size_along(axis);
    if (p.name == uniform_spacing_name(along)) return param("h" + along.name, e->origin);
  }
  return e;
}

/// The integral weight of `weighted`, times the spacing.
Expr StretchRewriter::size_along(int axis) {
  const auto a = static_cast<std::size_t>(axis);
  const Expr h = param("h" + problem_.axes[a].name);
  return times(norm(a, home_[a]), home_[a] ? times(h, *slopes_[a]) : over(h, metric(axis)));
}

Expr StretchRewriter::sampled(Sample sample, Origin origin) {
  for (std::size_t a = 0; a < sample.place.size(); ++a) {
    const int axis = static_cast<int>(a);
    sample.place[a] = (*this)(sample.place[a]);
    if (slopes_[a])
      sample.place[a] = UniformPlace(problem_.axes[a], axis, placements_.of(sample.field)[a]).of(sample.place[a]);
  }
  return model::sample(std::move(sample), origin);
}

Expr StretchRewriter::derivative_of(const Derivative& d, Origin origin) {
  Expr result = (*this)(d.operand);
  if (!is_stretched(d.axis)) return derivative(result, d.axis, d.order, origin);
  for (int order = 0; order < d.order; ++order) result = times(metric(d.axis), derivative(result, d.axis, 1, origin));
  return result;
}

Expr StretchRewriter::advection_of(const Advect& a, Origin origin) {
  std::vector<Expr> velocity = all(a.velocity);
  for (int axis = 0; axis < static_cast<int>(velocity.size()); ++axis) {
    Expr& along = velocity[static_cast<std::size_t>(axis)];
    if (is_stretched(axis) && !is_literal(along, 0)) along = times(along, metric(axis));
  }
  return advect(std::move(velocity), (*this)(a.operand), origin);
}

/// A value staggered along an axis has the slope of the map there as its weight.
Expr StretchRewriter::weighted(const Reduce& r, Origin origin) {
  Expr operand = (*this)(r.operand);
  const bool is_weighted = r.reduction == Reduce::Kind::mean || r.reduction == Reduce::Kind::integral;
  const Placement home =
      placements_.is_staggered() ? placements_.natural(r.operand).value_or(Placement{}) : Placement{};
  double factor = 1;
  for (std::size_t a = 0; a < slopes_.size(); ++a) {
    if (!is_weighted || !slopes_[a] || !r.over[a]) continue;
    operand = home[a] ? times(operand, *slopes_[a]) : over(operand, metric(static_cast<int>(a)));
    factor *= norm(a, home[a]);
  }
  Reduce result = r;
  result.operand = operand;
  return times(factor, reduce(std::move(result), origin));
}

/// Midway between the centres of the two cells next to a side, as differences use it.
double StretchRewriter::metric_beside(int axis, bool is_low) const {
  const Axis& along = problem_.axes[static_cast<std::size_t>(axis)];
  const auto in_cell = [&](double i) {
    const double h = along.spacing();
    return 1 / slope_at(axis, is_low ? along.low + i * h : along.high - i * h);
  };
  return 0.5 * (in_cell(0.5) + in_cell(1.5));
}

void StretchRewriter::rewrite(AxisSides& sides, int axis, const Placement& home) {
  const Axis& along = problem_.axes[static_cast<std::size_t>(axis)];
  for (Side* side : {&sides.low, &sides.high}) {
    side->value = (*this)(side->value);
    if (!is_stretched(axis)) continue;
    const double slope = slope_at(axis, side == &sides.low ? along.low : along.high);
    const SideCondition& condition = condition_of(side->kind);
    if (condition.gives_slope()) side->value = times(side->value, slope);
    if (condition.b == SideCondition::Part::given) side->b = over(side->b, slope);
    const bool goes_on = side->kind == SideKind::linear || side->kind == SideKind::outflow;
    if (goes_on && !home[static_cast<std::size_t>(axis)] && along.cells > 1) {
      side->kind = SideKind::line;
      side->a = slope * metric_beside(axis, side == &sides.low);
    }
  }
}

std::vector<Coefficient> StretchRewriter::metrics() const {
  std::vector<Coefficient> metrics;
  for (std::size_t a = 0; a < slopes_.size(); ++a) {
    if (!is_read_[a]) continue;
    const Axis& axis = problem_.axes[a];
    Coefficient metric{names_[a], {metric_of(*axis.stretch), "", "", {}, {}}};
    const int number = static_cast<int>(a);
    if (axis.topology == Topology::bounded)
      metric.walls = {number, 1 / slope_at(number, axis.low), 1 / slope_at(number, axis.high)};
    metrics.push_back(std::move(metric));
  }
  return metrics;
}

}  // namespace

bool is_metric(const Problem& problem, const Coefficient& coefficient) {
  const std::optional<Expr>& value = coefficient.value.formula;
  return value && std::ranges::any_of(problem.axes, [&](const Axis& axis) {
           return axis.stretch && *value == metric_of(*axis.stretch);
         });
}

std::string size_name(const Axis& axis) { return "size of " + axis.name; }
std::string uniform_spacing_name(const Axis& axis) { return "uniform spacing of " + axis.name; }

Problem in_uniform_coordinates(Problem problem) {
  const auto is_stretched = [](const Axis& axis) { return axis.stretch.has_value(); };
  if (std::ranges::none_of(problem.axes, is_stretched)) return problem;
  const Problem before = problem;
  StretchRewriter rewriter(before);
  rewrite_in_coordinates(problem, [&](const Expr& e, const Placement& home) {
    rewriter.begin(home);
    return rewriter(e);
  });
  for (State& state : problem.states) {
    rewriter.begin(state.placement);
    for (int axis = 0; axis < static_cast<int>(state.boundary.size()); ++axis)
      rewriter.rewrite(state.boundary[static_cast<std::size_t>(axis)], axis, state.placement);
  }
  for (Coefficient& metric : rewriter.metrics()) problem.coefficients.push_back(std::move(metric));
  return problem;
}

}  // namespace dpde::model
