// SPDX-License-Identifier: Apache-2.0
// Forces of masks on the fields that they fix: force_on(solid, u), torque_on(solid, u, about = (x, y)).
#include <fmt/format.h>

#include <variant>

#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

const std::string* name_in(const ast::Argument& argument) {
  const auto* name = argument.name.empty() ? std::get_if<ast::Name>(&argument.value->kind) : nullptr;
  return name ? &name->name : nullptr;
}

}  // namespace

namespace formulas {

namespace {

/// Time derivatives of the fixed field at the points inside; empty after a diagnostic.
std::vector<Expr> rates_inside(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const std::string *mask = name_in(e.arguments[0]), *held = name_in(e.arguments[1]);
  const auto rates_of = [&](const std::string* field, const std::string* of) {
    std::vector<Expr> rates;
    for (const std::string& state : components_of(here.elaboration, field ? *field : "")) {
      const auto found = here.elaboration.masks.forces.find(state);
      if (found != here.elaboration.masks.forces.end() && of && found->second.mask == *of)
        rates.push_back(found->second.rate);
    }
    return rates;
  };
  std::vector<Expr> rates = rates_of(held, mask);
  if (!rates.empty()) return rates;
  if (here.elaboration.sink.has_errors()) return {};  // its equation may have an error
  const std::string example =
      fmt::format("in the model, write mask solid; u = 0 inside solid; then {}(solid, u)", e.callee);
  const bool are_swapped = !rates_of(mask, held).empty();
  here.elaboration.sink.report(
      "not-allowed-here", range, {"a field that this mask does not hold", e.callee},
      are_swapped ? fmt::format("the mask comes first: {}({}, {})", e.callee, *held, *mask) : example);
  return {};
}

}  // namespace

/// force_on(solid, u): the amount that a mask takes from a fixed field per unit of time; the integral of its right-hand
/// side over the points inside.
TypedExpr force(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (here.context != FormulaContext::quantity) return refuse(here, e.callee, e.callee_range);
  if (!takes(here, e, 2)) return {};
  if (is_refused_in_curves(here.elaboration, e.callee, range)) return {};
  TypedExpr result{TypedExpr::Type::vector, {}};
  for (const Expr& rate : rates_inside(here, e, range))
    result.parts.push_back(reduce(Reduce::Kind::integral, rate, {range}));
  if (result.parts.empty()) return {};
  if (result.parts.size() == 1) result.type = TypedExpr::Type::number;
  return result;
}

/// The torque of that force about a point: a number on two axes, a vector on three.
TypedExpr torque(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (here.context != FormulaContext::quantity) return refuse(here, e.callee, e.callee_range);
  if (is_refused_in_curves(here.elaboration, e.callee, range)) return {};
  const bool fits = e.arguments.size() == 3 && e.arguments[2].name == "about" && here.axis_count() > 1;
  if (!fits) {
    here.elaboration.sink.report("wrong-argument-count", e.callee_range,
                                 {e.callee, "a mask, a velocity and a point", fmt::format("something else")},
                                 "on two or three axes write torque_on(solid, u, about = (0.5, 0.5))");
    return {};
  }
  const ast::Expr& point = e.arguments[2].value;
  const auto about = as_vector(here, numeric(here, point), point.range());
  const std::vector<Expr> rates = about ? rates_inside(here, e, range) : std::vector<Expr>{};
  if (rates.empty()) return {};
  if (static_cast<int>(rates.size()) != here.axis_count()) {
    here.elaboration.sink.report("wrong-length", e.arguments[1].value.range(),
                                 {counted(here.axis_count(), "component"), std::to_string(rates.size())},
                                 "the torque is that of a vector with all its components");
    return {};
  }
  const auto moment = [&](int arm, int along) {
    const auto at = static_cast<std::size_t>(arm), of = static_cast<std::size_t>(along);
    const Expr lever = binary(BinaryOp::subtract, coordinate(arm), (*about)[at]);
    return reduce(Reduce::Kind::integral, binary(BinaryOp::multiply, lever, rates[of]), {range});
  };
  const auto component = [&](int first, int second) {
    return binary(BinaryOp::subtract, moment(first, second), moment(second, first), {range});
  };
  if (here.axis_count() == 2) return {TypedExpr::Type::number, {component(0, 1)}};
  return {TypedExpr::Type::vector, {component(1, 2), component(2, 0), component(0, 1)}};
}

}  // namespace formulas

}  // namespace dpde::model
