// SPDX-License-Identifier: Apache-2.0
#include "model/from_ast/names/known_values.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/build.h"
#include "model/from_ast/names/constants.h"

namespace dpde::model {

std::optional<double> known_value(const Expr& e, const KnownValues& values) {
  const bool is_open = any_part(e, [&](const Expr& part) {
    const Param* param = as<Param>(part);
    const auto found = param ? values.find(param->name) : values.end();
    return param && (found == values.end() || !found->second);
  });
  if (is_open || !is_uniform(e)) return std::nullopt;
  const Value value = value_of(e, values);
  return value.mistake.empty() ? std::optional(value.number) : std::nullopt;
}

Expr with_known(const Expr& e, const KnownValues& values) {
  const auto same = [&](const Expr& part) { return with_known(part, values); };
  if (const auto* param = as<Param>(e)) {
    const auto found = values.find(param->name);
    return found != values.end() && found->second ? number(*found->second, e->origin) : e;
  }
  if (const auto* neg = as<Neg>(e)) return negate(same(neg->operand), e->origin);
  if (const auto* b = as<Binary>(e)) return binary(b->op, same(b->left), same(b->right), e->origin);
  if (const auto* s = as<Select>(e)) return select(same(s->condition), same(s->yes), same(s->no), e->origin);
  const auto* c = as<Call>(e);
  if (!c) return e;
  std::vector<Expr> arguments;
  for (const Expr& argument : c->arguments) arguments.push_back(same(argument));
  return call(c->fn, std::move(arguments), e->origin);
}

bool holds_time(const Expr& e) {
  return any_part(e, [](const Expr& part) {
    const Param* param = as<Param>(part);
    return param && param->name == "t";
  });
}

std::vector<double> times_of_run(const Problem& problem) {
  constexpr int most_times = 20000;
  const int halves = 2 * problem.steps, count = std::clamp(halves, 1, most_times);
  std::vector<double> times;
  for (int i = 0; i <= count; ++i)
    times.push_back(problem.t_begin + std::round(static_cast<double>(i) * halves / count) * problem.step / 2);
  return times;
}

KnownValues values_at_start(const Elaboration& elaboration) {
  KnownValues values = elaboration.params.values;
  for (const Unknown& unknown : elaboration.problem.task->unknowns) {
    if (unknown.kind != Unknown::Kind::parameter || !unknown.from.formula) continue;
    if (const Number* number = as<Number>(*unknown.from.formula)) values[unknown.name] = number->value;
  }
  return values;
}

}  // namespace dpde::model
