// SPDX-License-Identifier: Apache-2.0
#include "model/uses.h"

#include <type_traits>

#include "support/assert.h"

namespace dpde::model {

UseTime time_of(UseKind kind) {
  switch (kind) {
    case UseKind::equation:
    case UseKind::potential:
    case UseKind::constraint:
    case UseKind::correction:
    case UseKind::held_where:
    case UseKind::held_value:
    case UseKind::event:
    case UseKind::courant_rate: return UseTime::step;
    case UseKind::observable:
    case UseKind::output:
    case UseKind::loss:
    case UseKind::test:
    case UseKind::test_field: return UseTime::result;
    case UseKind::initial:
    case UseKind::coefficient:
    case UseKind::control:
    case UseKind::control_start:
    case UseKind::unknown_start:
    case UseKind::exact: return UseTime::field;
    case UseKind::boundary_value:
    case UseKind::boundary_weight: return UseTime::boundary;
    case UseKind::stretch_map:
    case UseKind::metric: return UseTime::geometry;
    case UseKind::stated_operator: return UseTime::never;
  }
  unreachable("kind of use");
}

bool is_of_states(UseKind kind) {
  switch (time_of(kind)) {
    case UseTime::step:
    case UseTime::result: return true;
    case UseTime::field:
    case UseTime::boundary:
    case UseTime::geometry:
    case UseTime::never: return false;
  }
  unreachable("time of a use");
}

bool makes_state(UseKind kind) {
  switch (kind) {
    case UseKind::equation:
    case UseKind::potential:  // the multiplier
    case UseKind::correction:
    case UseKind::event: return true;
    case UseKind::constraint:  // the potential's equation is made of it
    case UseKind::held_where:
    case UseKind::held_value: return false;    // as part of a correction
    case UseKind::courant_rate: return false;  // a separate program
    case UseKind::observable:
    case UseKind::output:
    case UseKind::loss:
    case UseKind::test:
    case UseKind::test_field:
    case UseKind::initial:
    case UseKind::coefficient:
    case UseKind::control:
    case UseKind::control_start:
    case UseKind::unknown_start:
    case UseKind::exact:
    case UseKind::boundary_value:
    case UseKind::boundary_weight:
    case UseKind::stretch_map:
    case UseKind::metric:
    case UseKind::stated_operator: return false;
  }
  unreachable("kind of use");
}

namespace {

/// Traverses a problem, const or mutable: `visit(kind, formula, home, origin, owner)`.
template <class P, class Visit>
class Formulas {
  template <class T>
  using Like = std::conditional_t<std::is_const_v<P>, const T, T>;

 public:
  Formulas(P& problem, const Visit& visit) : problem_(problem), visit_(visit) {}

  void all() const {
    for_each_in_steps();
    for_each_result();
    for_each_field();
    for_each_at_sides();
    for_each_of_geometry();
    for (auto& stated : problem_.operators) {
      for (auto& part : stated.body) visit_(UseKind::stated_operator, part, {}, stated.origin, stated.name);
    }
  }

 private:
  Placement home_of(const std::string& field) const {
    if (const State* state = problem_.find_state(field)) return state->placement;
    const Coefficient* coefficient = problem_.find_coefficient(field);
    return coefficient != nullptr ? coefficient->placement : Placement{};
  }

  void for_each_in_steps() const {
    for (auto& state : problem_.states) {
      if (state.rhs) visit_(UseKind::equation, *state.rhs, state.placement, state.origin, state.name);
    }
    for (auto& projection : problem_.projections) {
      const std::string& multiplier = projection.multiplier;
      if (projection.potential) {
        visit_(UseKind::potential, *projection.potential, {}, projection.origin, multiplier);
        visit_(UseKind::constraint, projection.constraint, {}, projection.origin, multiplier);
      }
      for_each_update(UseKind::correction, projection.updates, projection.origin);
    }
    for (auto& state : problem_.states) {
      if (!state.held) continue;
      visit_(UseKind::held_where, state.held->inside, state.placement, state.origin, state.name);
      visit_(UseKind::held_value, state.held->value, state.placement, state.origin, state.name);
    }
    for (auto& event : problem_.events) for_each_update(UseKind::event, event.updates, event.origin);
    if (problem_.substeps.rate)
      visit_(UseKind::courant_rate, *problem_.substeps.rate, {}, problem_.time_origin, problem_.scene);
  }

  void for_each_update(UseKind kind, Like<std::vector<Event::Update>>& updates, const Origin& origin) const {
    for (auto& update : updates) visit_(kind, update.value, home_of(update.state), origin, update.state);
  }

  void for_each_result() const {
    for (auto& observable : problem_.observables)
      visit_(UseKind::observable, observable.value, {}, observable.origin, observable.name);
    for (auto& shown : problem_.shown) visit_(UseKind::output, shown.value, shown.placement, shown.origin, shown.name);
    if (!problem_.task) return;
    for (auto& loss : problem_.task->losses) visit_(UseKind::loss, loss.value, {}, loss.origin, problem_.task->name);
    for (auto& test : problem_.task->tests) {
      auto& quantity = test.quantity;
      visit_(UseKind::test, quantity.value, {}, quantity.origin, quantity.name);
      for (auto& field : test.fields) visit_(UseKind::test_field, field, {}, quantity.origin, quantity.name);
    }
  }

  void for_each_field() const {
    for (auto& state : problem_.states) for_source(UseKind::initial, state.initial, state.placement, state.name);
    for (auto& coefficient : problem_.coefficients)
      for_source(UseKind::coefficient, coefficient.value, coefficient.placement, coefficient.name);
    for (auto& control : problem_.controls) {
      visit_(UseKind::control, control.formula, {}, control.origin, control.name);
      visit_(UseKind::control_start, control.start_formula, {}, control.origin, control.name);
    }
    for (auto& state : problem_.states) {
      if (state.exact) visit_(UseKind::exact, *state.exact, state.placement, state.origin, state.name);
    }
    if (!problem_.task) return;
    for (auto& unknown : problem_.task->unknowns)
      for_source(UseKind::unknown_start, unknown.from, unknown.is_field() ? home_of(unknown.name) : Placement{},
                 unknown.name);
  }

  void for_source(UseKind kind, Like<Source>& source, const Placement& home, const std::string& owner) const {
    if (source.formula) visit_(kind, *source.formula, home, source.origin, owner);
  }

  void for_each_at_sides() const {
    for (auto& state : problem_.states) {
      for (auto& sides : state.boundary) {
        for (auto* side : {&sides.low, &sides.high}) {
          visit_(UseKind::boundary_value, side->value, state.placement, state.origin, state.name);
          for (auto* weight : {&side->a, &side->b})
            visit_(UseKind::boundary_weight, *weight, state.placement, state.origin, state.name);
        }
      }
    }
  }

  void for_each_of_geometry() const {
    for (auto& axis : problem_.axes) {
      if (axis.stretch) visit_(UseKind::stretch_map, axis.stretch->map, {}, problem_.time_origin, axis.name);
    }
    if (!problem_.metric) return;
    for (auto& scale : problem_.metric->scales)
      visit_(UseKind::metric, scale, {}, problem_.time_origin, problem_.metric->name);
    visit_(UseKind::metric, problem_.metric->around, {}, problem_.time_origin, problem_.metric->name);
  }

  P& problem_;
  const Visit& visit_;
};

}  // namespace

void for_each_formula(const Problem& problem, const std::function<void(const Use&)>& f) {
  const auto visit = [&](UseKind kind, const Expr& formula, const Placement& home, const Origin& origin,
                         const std::string& owner) {
    f({kind, formula, home, origin, owner});
  };
  Formulas(problem, visit).all();
}

bool any_formula(const Problem& problem, const std::function<bool(const Use&)>& f) {
  bool found = false;
  for_each_formula(problem, [&](const Use& use) { found = found || f(use); });
  return found;
}

void rewrite_formulas(Problem& problem, const std::function<Expr(const Use&)>& f) {
  const auto visit = [&](UseKind kind, Expr& formula, const Placement& home, const Origin& origin,
                         const std::string& owner) {
    formula = f({kind, formula, home, origin, owner});
  };
  Formulas(problem, visit).all();
}

}  // namespace dpde::model
