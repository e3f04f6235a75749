// SPDX-License-Identifier: Apache-2.0
// What nobody reads is dropped or at least said. A hand-written program reads all that its kernels take.
#include <algorithm>

#include "model/build.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

/// Calls `f` on every expression that may read a coefficient.
template <class F>
void for_each_reader(const Problem& problem, const F& f) {
  for (const State& state : problem.states) {
    if (state.rhs) f(*state.rhs);
    for (const AxisSides& sides : state.boundary) {
      f(sides.low.value);
      f(sides.high.value);
    }
  }
  if (problem.rate) f(*problem.rate);
  for (const Event& event : problem.events) {
    for (const Event::Update& update : event.updates) f(update.value);
  }
  for (const Projection& projection : problem.projections) {
    for (const Event::Update& update : projection.updates) f(update.value);
  }
  for (const Quantity& observable : problem.observables) f(observable.value);
  for (const Shown& shown : problem.shown) f(shown.value);
  if (!problem.task) return;
  for (const Loss& loss : problem.task->losses) f(loss.value);
  for (const Test& test : problem.task->tests) f(test.quantity.value);
}

/// Whether anything reads the coefficient or the task seeks it.
bool is_needed(const Problem& problem, const std::string& coefficient) {
  bool found = problem.task && std::ranges::any_of(problem.task->unknowns, [&](const Unknown& unknown) {
                 return unknown.kind == Unknown::Kind::coefficient && unknown.name == coefficient;
               });
  for_each_reader(problem, [&](const Expr& e) { found = found || reads(e, coefficient); });
  return found;
}

}  // namespace

void drop_unused(Draft& draft) {
  Problem& problem = draft.problem;
  for (Parameter& parameter : problem.params) parameter.is_fixed = draft.fixed.contains(parameter.name);
  if (draft.program) return;
  std::vector<Coefficient> kept;
  for (const Coefficient& coefficient : problem.coefficients) {
    if (is_needed(problem, coefficient.name)) {
      kept.push_back(coefficient);
    } else {
      problem.dropped.push_back("coefficient " + coefficient.name + ": nothing reads it");
    }
  }
  problem.coefficients = std::move(kept);
  for (const Parameter& parameter : problem.params) {
    if (draft.used.contains(parameter.name)) continue;
    problem.dropped.push_back("parameter " + parameter.name + ": nothing uses it");
    if (!draft.selection.beside.empty()) continue;  // the task's own scene may
    draft.sink.report("unused-parameter", draft.scope.find(parameter.name)->declared, {parameter.name});
  }
}

}  // namespace dpde::model
