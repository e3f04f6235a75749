// SPDX-License-Identifier: Apache-2.0
#include "model/boundary/falling_axes.h"

#include <algorithm>
#include <utility>

#include "model/build.h"
#include "model/rewrite.h"
#include "support/match.h"

namespace dpde::model {

namespace {

/// The operand if `e` is a negation, else nullptr.
const Expr* negated(const Expr& e) {
  const auto* neg = as<Neg>(e);
  return neg ? &neg->operand : nullptr;
}

/// Moves signs of the operands of a sum or product outwards, or cancels them.
Expr with_signs_outside(BinaryOp op, const Expr& left, const Expr& right, Origin origin) {
  const Expr *of_left = negated(left), *of_right = negated(right);
  const Expr& a = of_left ? *of_left : left;
  const Expr& b = of_right ? *of_right : right;
  if (op == BinaryOp::multiply || op == BinaryOp::divide) {
    const Expr result = binary(op, a, b, origin);
    return (of_left != nullptr) != (of_right != nullptr) ? negate(result, origin) : result;
  }
  if (op != BinaryOp::add && op != BinaryOp::subtract) return binary(op, left, right, origin);
  const bool subtracts = (op == BinaryOp::subtract) != (of_right != nullptr);
  if (!of_left) return binary(subtracts ? BinaryOp::subtract : BinaryOp::add, a, b, origin);
  if (!subtracts) return binary(BinaryOp::subtract, b, a, origin);
  return negate(binary(BinaryOp::add, a, b, origin), origin);
}

class FallingAxesRewriter {
 public:
  explicit FallingAxesRewriter(const std::vector<Axis>& axes) : axes_(axes) {}

  Expr operator()(const Expr& e) const;
  void rewrite(std::vector<AxisSides>& boundary) const;

 private:
  bool falls(int axis) const { return axes_[static_cast<std::size_t>(axis)].runs_down(); }
  std::vector<Expr> all(std::vector<Expr> parts) const {
    for (Expr& part : parts) part = (*this)(part);
    return parts;
  }
  /// Converts a position to the coordinate, and the other way round.
  Expr turned(int axis, const Expr& e) const {
    return binary(BinaryOp::subtract, *axes_[static_cast<std::size_t>(axis)].ends, e, e->origin);
  }
  Expr derivative_of(const Derivative& d, Origin origin) const;
  Expr advection_of(const Advect& a, Origin origin) const;
  Expr sampled(Sample sample, Origin origin) const;
  Expr applied(const Apply& a, Origin origin) const;
  Expr solved(Solve solve, Origin origin) const;

  const std::vector<Axis>& axes_;
};

Expr FallingAxesRewriter::operator()(const Expr& e) const {
  const Origin origin = e->origin;
  return match(
      e->kind, [&](const Number&) { return e; }, [&](const Field&) { return e; }, [&](const Noise&) { return e; },
      [&](const Param&) { return e; }, [&](const Coordinate& c) { return falls(c.axis) ? turned(c.axis, e) : e; },
      [&](const Neg& n) { return negate((*this)(n.operand), origin); },
      [&](const Binary& b) {
        const Expr left = (*this)(b.left);
        return with_signs_outside(b.op, left, (*this)(b.right), origin);
      },
      [&](const Call& c) { return call(c.fn, all(c.arguments), origin); },
      [&](const Select& s) {
        const Expr condition = (*this)(s.condition), yes = (*this)(s.yes);
        return select(condition, yes, (*this)(s.no), origin);
      },
      [&](const Derivative& d) { return derivative_of(d, origin); },
      [&](const Advect& a) { return advection_of(a, origin); },
      [&](const Shift& s) {
        std::vector<int> offset = s.offset;
        for (std::size_t a = 0; a < offset.size(); ++a) offset[a] = axes_[a].runs_down() ? -offset[a] : offset[a];
        return shift((*this)(s.operand), std::move(offset), origin);
      },
      [&](const Interpolate& i) { return interpolate((*this)(i.operand), origin); },
      [&](const BandPass& b) {
        return band_pass({(*this)(b.operand), b.first, b.last, b.unit}, origin);
      },
      [&](const Sample& s) { return sampled(s, origin); },
      [&](const Reduce& r) {
        Reduce result = r;
        result.operand = (*this)(r.operand);
        return reduce(std::move(result), origin);
      },
      [&](const Apply& a) { return applied(a, origin); },
      [&](const NetworkCall& i) {
        return network_call({i.network, all(i.arguments), i.output, i.outputs, i.name}, origin);
      },
      [&](const Solve& s) { return solved(s, origin); });
}

Expr FallingAxesRewriter::derivative_of(const Derivative& d, Origin origin) const {
  const Expr operand = (*this)(d.operand);
  const Expr* inside = negated(operand);
  const Expr result = derivative(inside ? *inside : operand, d.axis, d.order, origin);
  const bool changes_sign = falls(d.axis) && d.order % 2 != 0;
  return changes_sign != (inside != nullptr) ? negate(result, origin) : result;
}

Expr FallingAxesRewriter::advection_of(const Advect& a, Origin origin) const {
  std::vector<Expr> velocity = all(a.velocity);
  for (int axis = 0; axis < static_cast<int>(velocity.size()); ++axis) {
    Expr& along = velocity[static_cast<std::size_t>(axis)];
    if (falls(axis)) along = negate(along, along->origin);
  }
  return advect(std::move(velocity), (*this)(a.operand), origin);
}

Expr FallingAxesRewriter::sampled(Sample sample, Origin origin) const {
  for (std::size_t a = 0; a < sample.place.size(); ++a) {
    sample.place[a] = (*this)(sample.place[a]);
    if (!axes_[a].runs_down()) continue;
    sample.place[a] = turned(static_cast<int>(a), sample.place[a]);
    if (sample.along[a] != InterpolationBasis::linear)
      sample.along[a] =
          sample.along[a] == InterpolationBasis::lower ? InterpolationBasis::upper : InterpolationBasis::lower;
  }
  return model::sample(std::move(sample), origin);
}

Expr FallingAxesRewriter::applied(const Apply& a, Origin origin) const {
  Operator function = a.function;
  function.body = all(function.body);
  for (Operator::Adjoint& adjoint : function.adjoints) adjoint.value = (*this)(adjoint.value);
  return apply({std::move(function), all(a.arguments), a.component, a.places, a.results}, origin);
}

Expr FallingAxesRewriter::solved(Solve solve, Origin origin) const {
  solve.operation = (*this)(solve.operation);
  solve.right = (*this)(solve.right);
  for (Expr& start : solve.starts) start = (*this)(start);
  if (solve.preconditioner) solve.preconditioner = (*this)(*solve.preconditioner);
  rewrite(solve.boundary);
  return model::solve(std::move(solve), origin);
}

void FallingAxesRewriter::rewrite(std::vector<AxisSides>& boundary) const {
  for (std::size_t axis = 0; axis < boundary.size(); ++axis) {
    AxisSides& sides = boundary[axis];
    for (Side* side : {&sides.low, &sides.high}) side->value = (*this)(side->value);
    if (axes_[axis].runs_down()) std::swap(sides.low, sides.high);
  }
}

}  // namespace

Problem in_rising_coordinates(Problem problem) {
  const std::vector<Axis> axes = problem.axes;
  if (std::ranges::none_of(axes, &Axis::runs_down)) return problem;
  const FallingAxesRewriter rewriter(axes);
  rewrite_in_coordinates(problem, [&](const Expr& e, const Placement&) { return rewriter(e); });
  for (State& state : problem.states) rewriter.rewrite(state.boundary);
  for (Coefficient& coefficient : problem.coefficients) {
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      if (axes[axis].runs_down()) std::swap(coefficient.at_poles[axis].low, coefficient.at_poles[axis].high);
    }
    if (coefficient.walls && axes[static_cast<std::size_t>(coefficient.walls->axis)].runs_down())
      std::swap(coefficient.walls->low, coefficient.walls->high);
  }
  return problem;
}

}  // namespace dpde::model
