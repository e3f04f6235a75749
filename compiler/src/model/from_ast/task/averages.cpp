// SPDX-License-Identifier: Apache-2.0
// Losses of averages: (average(mean(u^2)) - average(mean(v^2)))^2. Each average is the mean of a quantity over the
// selected states; the loss is a formula of these numbers, evaluated once per run.
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace formulas {

TypedExpr average(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const auto refuse_here = [&](const std::string& where, const std::string& hint) {
    here.elaboration.sink.report("not-allowed-here", e.callee_range, {"average", where}, hint);
    return TypedExpr{};
  };
  if (!takes(here, e, 1)) return {};
  if (here.context != FormulaContext::quantity || !here.elaboration.averages.are_taken)
    return refuse_here(here.context == FormulaContext::quantity ? here.subject : std::string(place_of(here.context)),
                       "it is the mean over the states of a loss, as in minimise (average(mean(u^2)) - 1)^2 over 8 "
                       "steps; the mean over the grid is mean(u)");
  if (here.is_in_average)
    return refuse_here("an average", "average(mean(u^2)) is the mean over space and over the states");
  here.is_in_average = true;
  const auto value = number(here, e.arguments[0].value);
  here.is_in_average = false;
  const std::optional<Expr> quantity =
      value ? quantity_of(here.elaboration, *value, "an average", e.arguments[0].value.range()) : std::nullopt;
  if (!quantity) return {};
  for (const ElaboratedAverages::Average& known : here.elaboration.averages.of_loss) {
    if (known.value == *quantity) return number_of(model::param(known.name, {range}));
  }
  std::string name;
  do {
    name = fmt::format("average_{}", ++here.elaboration.averages.count);
  } while (here.elaboration.names.scope.find(name) != nullptr);
  here.elaboration.averages.of_loss.push_back({name, *quantity, {range}});
  return number_of(model::param(name, {range}));
}

}  // namespace formulas

namespace {

/// A part of `e` that depends on a state, and so is not allowed in a formula of numbers; nullptr if there is none.
const Expr* no_number(const Elaboration& elaboration, const Expr& e) {
  const Param* param = as<Param>(e);
  const auto is_average = [&](const ElaboratedAverages::Average& average) {
    return param != nullptr && average.name == param->name;
  };
  if (param != nullptr) {
    const bool is_known = std::ranges::any_of(elaboration.averages.of_loss, is_average) ||
                          (elaboration.problem.find_param(param->name) != nullptr &&
                           elaboration.problem.find_control(param->name) == nullptr);
    return is_known ? nullptr : &e;
  }
  const bool is_of_numbers = is<Number, Neg, Binary, Call, Select>(e);
  const Expr* found = is_of_numbers ? nullptr : &e;
  for_each_child(e, [&](const Expr& part) {
    if (found == nullptr) found = no_number(elaboration, part);
  });
  return found;
}

}  // namespace

void add_loss_of_averages(Elaboration& elaboration, const Expr& value, const When& when, SourceRange range) {
  const auto refuse = [&](SourceRange where, const std::string& what, const std::string& hint) {
    elaboration.sink.report("not-allowed-here", where.is_known() ? where : range, {what, "a loss of averages"}, hint);
  };
  if (const Expr* mistake = no_number(elaboration, value))
    return refuse((*mistake)->origin.range, "a value that each state has for itself",
                  "a loss of averages is a formula of them, of numbers and of parameters, once a run; write a line of "
                  "its own for the rest: minimise mean((u - v)^2) over 8 steps");
  if ((when.kind != When::Kind::over && when.kind != When::Kind::steps) || when.is_last)
    return refuse(range, "a given time", "it is of all states of a run or window: write over time, or over 8 steps");
  if (when.counted) return refuse(range, "mean, sum or integral over them", "it is one number a run: leave that out");
  When of_average = when;
  of_average.counted = Reduce::Kind::mean;
  std::vector<Loss>& losses = elaboration.problem.task->losses;
  for (const ElaboratedAverages::Average& average : elaboration.averages.of_loss)
    losses.push_back({average.value, of_average, average.origin, average.name});
  losses.push_back({value, when, {range}, "", true});
}

}  // namespace dpde::model
