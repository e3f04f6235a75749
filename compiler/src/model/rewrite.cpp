// SPDX-License-Identifier: Apache-2.0
#include "model/rewrite.h"

#include <optional>

namespace dpde::model {

namespace {

class Formulas {
 public:
  Formulas(const Problem& problem, const FormulaRule& rule) : problem_(problem), rule_(rule) {}

  void rewrite(Expr& e, const Placement& home = {}) const { e = rule_(e, home); }
  void rewrite(std::optional<Expr>& e, const Placement& home = {}) const {
    if (e) rewrite(*e, home);
  }
  void rewrite(State& state) const {
    rewrite(state.rhs, state.placement);
    rewrite(state.initial.formula, state.placement);
    rewrite(state.exact, state.placement);
    if (!state.held) return;
    rewrite(state.held->inside, state.placement);
    rewrite(state.held->value, state.placement);
  }
  void rewrite(std::vector<Event::Update>& updates) const {
    for (Event::Update& update : updates) rewrite(update.value, problem_.find_state(update.state)->placement);
  }
  void rewrite(Projection& projection) const {
    rewrite(projection.potential);
    rewrite(projection.constraint);
    rewrite(projection.updates);
  }
  void rewrite(Task& task) const {
    for (Unknown& unknown : task.unknowns) rewrite(unknown.from.formula);
    for (Loss& loss : task.losses) rewrite(loss.value);
    for (Test& test : task.tests) {
      rewrite(test.quantity.value);
      for (Expr& field : test.fields) rewrite(field);
    }
  }

 private:
  const Problem& problem_;
  const FormulaRule& rule_;
};

}  // namespace

void rewrite_formulas(Problem& problem, const FormulaRule& rule) {
  const Formulas formulas(problem, rule);
  for (State& state : problem.states) formulas.rewrite(state);
  for (Coefficient& coefficient : problem.coefficients) formulas.rewrite(coefficient.value.formula);
  for (Quantity& observable : problem.observables) formulas.rewrite(observable.value);
  for (Shown& shown : problem.shown) formulas.rewrite(shown.value);
  for (Event& event : problem.events) formulas.rewrite(event.updates);
  for (Projection& projection : problem.projections) formulas.rewrite(projection);
  for (StatedOrder& stated : problem.operators) {
    for (Expr& part : stated.body) formulas.rewrite(part);
  }
  formulas.rewrite(problem.rate);
  if (problem.task) formulas.rewrite(*problem.task);
}

}  // namespace dpde::model
