// SPDX-License-Identifier: Apache-2.0
#include "model/stretch.h"

#include <algorithm>
#include <utility>

#include "model/build.h"
#include "model/formula.h"
#include "model/placement.h"
#include "support/match.h"

namespace dpde::model {

namespace {

Expr times(const Expr& a, const Expr& b) { return binary(BinaryOp::multiply, a, b); }
Expr over(const Expr& a, const Expr& b, Origin origin = {}) { return binary(BinaryOp::divide, a, b, origin); }

bool is_taken(const Problem& problem, const std::string& name) {
  const auto is_datum = [&](const Datum& datum) { return datum.name == name; };
  return problem.find_state(name) || problem.find_coefficient(name) || problem.find_param(name) ||
         std::ranges::any_of(problem.observables, [&](const Quantity& observable) { return observable.name == name; }) ||
         (problem.task && std::ranges::any_of(problem.task->data, is_datum));
}

/// 1 over the mean of the slope, at the centres or at the upper faces of the cells.
double normalisation(const Axis& axis, const Expr& slope, bool on_faces) {
  double sum = 0;
  for (int i = 0; i < axis.cells; ++i) sum += value_at(slope, axis.low + (i + (on_faces ? 1.0 : 0.5)) * axis.spacing());
  return axis.cells / sum;
}

class Rewriter {
 public:
  explicit Rewriter(const Problem& problem) : problem_(problem), placements_(problem) {
    for (const Axis& axis : problem.axes) {
      slopes_.push_back(axis.stretch ? std::optional(slope_of(axis.stretch->map)) : std::nullopt);
      names_.push_back(axis.name + "_metric");
      while (is_taken(problem, names_.back())) names_.back() += "_";
    }
    is_read_.resize(problem.axes.size());
  }

  Expr operator()(const Expr& e);
  void rewrite(std::optional<Expr>& e) {
    if (e) e = (*this)(*e);
  }
  void rewrite(AxisSides& sides, int axis);
  /// The coefficients that were read so far.
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
  Expr spacing_or(const Param& p, const Expr& e);
  Expr derivative_of(const Derivative& d, Origin origin);
  Expr advection_of(const Advect& a, Origin origin);
  Expr weighted(const Reduce& r, Origin origin);

  const Problem& problem_;
  const Placements placements_;
  std::vector<std::optional<Expr>> slopes_;  // one an axis; none where it is uniform
  std::vector<std::string> names_;
  std::vector<bool> is_read_;
};

Expr Rewriter::operator()(const Expr& e) {
  const Origin origin = e->origin;
  return match(
      e->kind, [&](const Number&) { return e; }, [&](const Field&) { return e; }, [&](const Noise&) { return e; }, [&](const Sample&) { return e; },
      [&](const Param& p) { return spacing_or(p, e); },
      [&](const Coordinate& c) { return is_stretched(c.axis) ? problem_.axes[static_cast<std::size_t>(c.axis)].stretch->map : e; },
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
      [&](const Derivative& d) { return derivative_of(d, origin); }, [&](const Advect& a) { return advection_of(a, origin); },
      [&](const Shift& s) { return shift((*this)(s.operand), s.offset, origin); },
      [&](const Interpolate& i) { return interpolate((*this)(i.operand), origin); }, [&](const Reduce& r) { return weighted(r, origin); },
      [&](const Apply& a) { return apply({a.function, all(a.arguments)}, origin); },
      [&](const Infer& i) { return infer({i.network, all(i.arguments), i.output, i.outputs, i.name}, origin); });
}

Expr Rewriter::spacing_or(const Param& p, const Expr& e) {
  for (int axis = 0; axis < static_cast<int>(slopes_.size()); ++axis) {
    const bool is_its_spacing = p.name == "h" + problem_.axes[static_cast<std::size_t>(axis)].name;
    if (is_its_spacing && is_stretched(axis)) return over(e, metric(axis), e->origin);
  }
  return e;
}

Expr Rewriter::derivative_of(const Derivative& d, Origin origin) {
  Expr result = (*this)(d.operand);
  if (!is_stretched(d.axis)) return derivative(result, d.axis, d.order, origin);
  for (int order = 0; order < d.order; ++order) result = times(metric(d.axis), derivative(result, d.axis, 1, origin));
  return result;
}

Expr Rewriter::advection_of(const Advect& a, Origin origin) {
  std::vector<Expr> velocity = all(a.velocity);
  for (int axis = 0; axis < static_cast<int>(velocity.size()); ++axis) {
    Expr& along = velocity[static_cast<std::size_t>(axis)];
    if (is_stretched(axis) && !is_constant(along, 0)) along = times(along, metric(axis));
  }
  return advect(std::move(velocity), (*this)(a.operand), origin);
}

/// What is staggered along an axis is weighted by the slope of the map there.
Expr Rewriter::weighted(const Reduce& r, Origin origin) {
  Expr operand = (*this)(r.operand);
  const bool is_weighted = r.reduction == Reduce::Kind::mean || r.reduction == Reduce::Kind::integral;
  const Placement home = placements_.is_staggered() ? placements_.natural(r.operand).value_or(Placement{}) : Placement{};
  double factor = 1;
  for (std::size_t a = 0; a < slopes_.size(); ++a) {
    if (!is_weighted || !slopes_[a] || !r.over[a]) continue;
    operand = home[a] ? times(operand, *slopes_[a]) : over(operand, metric(static_cast<int>(a)));
    factor *= normalisation(problem_.axes[a], *slopes_[a], home[a]);
  }
  Reduce result = r;
  result.operand = operand;
  return times(factor, reduce(std::move(result), origin));
}

void Rewriter::rewrite(AxisSides& sides, int axis) {
  const Axis& along = problem_.axes[static_cast<std::size_t>(axis)];
  for (Side* side : {&sides.low, &sides.high}) {
    side->value = (*this)(side->value);
    if (!is_stretched(axis)) continue;
    const double slope = slope_at(axis, side == &sides.low ? along.low : along.high);
    if (side->kind == SideKind::gradient) side->value = times(side->value, slope);
    if (side->kind == SideKind::mixed) side->b = over(side->b, slope);
  }
}

std::vector<Coefficient> Rewriter::metrics() const {
  std::vector<Coefficient> metrics;
  for (std::size_t a = 0; a < slopes_.size(); ++a) {
    if (!is_read_[a]) continue;
    const Axis& axis = problem_.axes[a];
    Coefficient metric{names_[a], {over(1.0, *slopes_[a]), "", "", {}, {}}};
    const int number = static_cast<int>(a);
    if (axis.topology == Topology::bounded) metric.walls = {number, 1 / slope_at(number, axis.low), 1 / slope_at(number, axis.high)};
    metrics.push_back(std::move(metric));
  }
  return metrics;
}

void rewrite_task(Rewriter& rewriter, Task& task) {
  for (Unknown& unknown : task.unknowns) rewriter.rewrite(unknown.from.formula);
  for (Loss& loss : task.losses) loss.value = rewriter(loss.value);
  for (Test& test : task.tests) test.quantity.value = rewriter(test.quantity.value);
}

}  // namespace

Problem in_uniform_coordinates(Problem problem) {
  const auto is_stretched = [](const Axis& axis) { return axis.stretch.has_value(); };
  if (std::ranges::none_of(problem.axes, is_stretched)) return problem;
  const Problem before = problem;
  Rewriter rewriter(before);
  for (State& state : problem.states) {
    rewriter.rewrite(state.rhs);
    rewriter.rewrite(state.initial.formula);
    rewriter.rewrite(state.exact);
    for (int axis = 0; axis < static_cast<int>(state.boundary.size()); ++axis) rewriter.rewrite(state.boundary[static_cast<std::size_t>(axis)], axis);
  }
  for (Coefficient& coefficient : problem.coefficients) rewriter.rewrite(coefficient.value.formula);
  for (Quantity& observable : problem.observables) observable.value = rewriter(observable.value);
  for (Event& event : problem.events) {
    for (Event::Update& update : event.updates) update.value = rewriter(update.value);
  }
  for (StatedOrder& stated : problem.operators) {
    for (Expr& part : stated.body) part = rewriter(part);
  }
  rewriter.rewrite(problem.rate);
  if (problem.task) rewrite_task(rewriter, *problem.task);
  for (Coefficient& metric : rewriter.metrics()) problem.coefficients.push_back(std::move(metric));
  return problem;
}

}  // namespace dpde::model
