// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/implicit_part.h"

#include <algorithm>

namespace dpde::model {

namespace {

/// The highest order of nested derivatives of the field itself; -1 if the field does not occur.
int order_of(const Expr& e, const std::string& field) {
  if (const auto* read = as<Field>(e)) return read->name == field ? 0 : -1;
  int inside = -1;
  for_each_child(e, [&](const Expr& part) { inside = std::max(inside, order_of(part, field)); });
  const auto* derivative = as<Derivative>(e);
  return inside >= 0 && derivative ? inside + derivative->order : inside;
}

bool is_solved_for(const Problem& problem, const std::string& state, const Expr& linear) {
  const bool holds_more = any_part(linear, [&](const Expr& part) {
    const auto* read = as<Field>(part);
    const bool is_other = read && read->name != state && problem.find_state(read->name) != nullptr;
    return is_other || is<Advect>(part);
  });
  return !holds_more && order_of(linear, state) >= 2;
}

}  // namespace

std::string_view name_of(Implicit implicit) {
  switch (implicit) {
    case Implicit::linear: return "linear";
    case Implicit::all_but_advect: return "all_but_advect";
    case Implicit::all: return "all";
  }
  return "";
}

LinearPart implicit_part(const Problem& problem, const std::string& state, const Expr& rate) {
  const Implicit implicit = problem.scheme.implicit;
  LinearPart result;
  if (implicit == Implicit::all) {
    result.part = rate;
    return result;
  }
  for (const Term& term : terms_of(rate)) {
    const auto add = [&](Expr& sum, const Expr& value) {
      sum = binary(term.negative ? BinaryOp::subtract : BinaryOp::add, sum, value, value->origin);
    };
    if (implicit == Implicit::all_but_advect) {
      const bool is_carried = holds_any<Advect>(term.value);
      add(is_carried ? result.rest : result.part, term.value);
      continue;
    }
    Origin nonlinear;
    const std::optional<LinearPart> parts = linear_part(term.value, state, nonlinear);
    if (parts && is_solved_for(problem, state, parts->part)) {
      add(result.part, parts->part);
      add(result.rest, parts->rest);
    } else {
      add(result.rest, term.value);
    }
  }
  return result;
}

bool holds_at_states(const Problem& problem) {
  const auto is_state = [&](const Expr& part) {
    const Field* field = as<Field>(part);
    return field != nullptr && problem.find_state(field->name) != nullptr;
  };
  return std::ranges::any_of(problem.states, [&](const State& state) {
    return state.held && (any_part(state.held->inside, is_state) || any_part(state.held->value, is_state));
  });
}

}  // namespace dpde::model
