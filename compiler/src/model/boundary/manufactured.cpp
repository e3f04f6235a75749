// SPDX-License-Identifier: Apache-2.0
#include "model/boundary/manufactured.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "model/analyse/formula.h"
#include "model/build.h"

namespace dpde::model {

namespace {

constexpr double base = 1, apart = 0.1, amplitude = 0.2;

class Manufacturer {
 public:
  explicit Manufacturer(Problem& problem) : problem_(problem) {}

  /// "" on success.
  std::string make() {
    if (const std::string what = what_stands_in_the_way(); !what.empty()) return what + " stand in the way";
    for (std::size_t i = 0; i < problem_.states.size(); ++i)
      solutions_.emplace(problem_.states[i].name, solution(i, param("t")));
    std::vector<Expr> rates;
    for (const State& state : problem_.states) rates.push_back(rate_of(state));
    if (!why_.empty()) return why_;
    for (std::size_t i = 0; i < problem_.states.size(); ++i) {
      State& state = problem_.states[i];
      if (!state.history_of.empty()) continue;
      if (state.rhs) state.rhs = rates[i];
      state.initial = {solution(i, number(problem_.t_begin)), "", "", {}, state.initial.origin};
      state.exact = solution(i, param("t"));
    }
    return "";
  }

 private:
  std::string what_stands_in_the_way() const {
    if (!problem_.program.empty()) return "hand-written steps";
    if (!problem_.projections.empty()) return "constraints and masks";
    if (!problem_.events.empty()) return "events";
    if (!problem_.controls.empty()) return "controls";
    if (problem_.metric) return "curved coordinates";
    const auto is_ring = [](const Axis& axis) { return axis.topology == Topology::periodic && !axis.stretch; };
    if (!std::ranges::all_of(problem_.axes, is_ring)) return "walls and stretched axes";
    const auto is_held = [](const State& state) { return state.held.has_value(); };
    return std::ranges::any_of(problem_.states, is_held) ? "masks" : "";
  }

  std::size_t index_of(const std::string& name) const {
    return static_cast<std::size_t>(std::ranges::find(problem_.states, name, &State::name) - problem_.states.begin());
  }

  Expr phase(std::size_t state, std::size_t axis, const Expr& t) const {
    const Axis& along = problem_.axes[axis];
    const Expr place =
        binary(BinaryOp::divide, binary(BinaryOp::subtract, coordinate(static_cast<int>(axis)), along.low),
               along.high - along.low);
    const Expr passed = binary(BinaryOp::divide, binary(BinaryOp::subtract, t, problem_.t_begin), duration());
    const Expr turns = binary(BinaryOp::subtract, place, passed);
    return binary(BinaryOp::add, binary(BinaryOp::multiply, 2 * std::numbers::pi, turns),
                  static_cast<double>(state + axis));
  }
  double duration() const { return problem_.steps * problem_.step; }

  /// U, or dt(U) if the state is the velocity of another one.
  Expr solution(std::size_t i, const Expr& t) const {
    const std::string& carried = problem_.states[i].velocity_of;
    const std::size_t state = carried.empty() ? i : index_of(carried);
    Expr sum = carried.empty() ? number(base + apart * static_cast<double>(i)) : number(0);
    for (std::size_t axis = 0; axis < problem_.axes.size(); ++axis) {
      const Expr angle = phase(state, axis, t);
      const double of_rate = -2 * std::numbers::pi / duration();
      const Expr wave = carried.empty() ? binary(BinaryOp::multiply, amplitude, call(Fn::sin, {angle}))
                                        : binary(BinaryOp::multiply, amplitude * of_rate, call(Fn::cos, {angle}));
      sum = binary(BinaryOp::add, sum, wave);
    }
    return sum;
  }

  /// f(u) + dt(U) - f(U); for a state with a velocity f is the velocity.
  Expr rate_of(const State& state) {
    if (!state.rhs || is<Field>(*state.rhs)) return state.rhs.value_or(Expr(0.0));
    const Expr in_time = slope_of(solutions_.at(state.name), {.is_time = true});
    const Expr source = binary(BinaryOp::subtract, in_time, with_solutions(*state.rhs));
    return binary(BinaryOp::add, *state.rhs, source);
  }

  std::vector<Expr> all(std::vector<Expr> parts) {
    for (Expr& part : parts) part = with_solutions(part);
    return parts;
  }

  Expr value_of(const Field& field) {
    if (const auto known = solutions_.find(field.name); known != solutions_.end()) return known->second;
    const Coefficient* coefficient = problem_.find_coefficient(field.name);
    if (coefficient != nullptr && coefficient->value.formula && !coefficient->is_control())
      return with_solutions(*coefficient->value.formula);
    why_ = fmt::format("{} is no formula", field.name);
    return 0.0;
  }

  Expr with_solutions(const Expr& e) {
    if (const auto* f = as<Field>(e)) return value_of(*f);
    if (const auto* n = as<Neg>(e)) return negate(with_solutions(n->operand));
    if (const auto* b = as<Binary>(e)) return binary(b->op, with_solutions(b->left), with_solutions(b->right));
    if (const auto* c = as<Call>(e)) return call(c->fn, all(c->arguments));
    if (const auto* s = as<Select>(e))
      return select(with_solutions(s->condition), with_solutions(s->yes), with_solutions(s->no));
    if (const auto* i = as<Interpolate>(e)) return with_solutions(i->operand);
    if (const auto* d = as<Derivative>(e)) {
      Expr result = with_solutions(d->operand);
      for (int k = 0; k < d->order; ++k) result = slope_of(result, {.axis = d->axis});
      return result;
    }
    if (const auto* a = as<Advect>(e)) {
      const Expr carried = with_solutions(a->operand);
      Expr sum = 0.0;
      for (std::size_t axis = 0; axis < a->velocity.size(); ++axis)
        sum = binary(BinaryOp::add, sum,
                     binary(BinaryOp::multiply, with_solutions(a->velocity[axis]),
                            slope_of(carried, {.axis = static_cast<int>(axis)})));
      return sum;
    }
    const bool is_closed = is<Number, Param, Coordinate>(e);
    if (is_closed) return e;
    why_ = "an equation holds means, neighbours, networks, noise or solves";
    return 0.0;
  }

  Problem& problem_;
  std::map<std::string, Expr> solutions_;
  std::string why_;
};

}  // namespace

bool manufacture(Problem& problem, DiagnosticSink& sink) {
  const std::string why = Manufacturer(problem).make();
  if (why.empty()) return true;
  sink.report("no-reference", problem.time_origin.range,
              {problem.scene, "no solution can be manufactured for it: " + why},
              "an exact solution of the scene, or a finer run, is taken without --manufactured");
  return false;
}

}  // namespace dpde::model
