// SPDX-License-Identifier: Apache-2.0
#include "model/from_ast/names/constants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/maths/evaluate.h"

namespace dpde::model {

namespace {

class Evaluation {
 public:
  explicit Evaluation(const std::map<std::string, std::optional<double>>& values) : values_(values) {}

  double operator()(const Expr& e) {
    return match(
        e->kind, [](const Number& n) { return n.value; }, [&](const Param& p) { return values_.at(p.name).value(); },
        [](const Field&) -> double { unreachable("a field in a number"); },
        [](const Coordinate&) -> double { unreachable("a coordinate in a number"); },
        [](const Noise&) -> double { unreachable("noise in a number"); },
        [&](const Neg& n) { return -(*this)(n.operand); },
        [&](const Binary& b) {
          const double left = (*this)(b.left), right = (*this)(b.right);
          const bool by_zero = b.op == BinaryOp::divide && right == 0;
          return checked(evaluate_binary(b.op, left, right), e,
                         by_zero ? "division by zero" : "the result is too large or undefined");
        },
        [&](const Call& c) {
          std::vector<double> arguments;
          for (const Expr& argument : c.arguments) arguments.push_back((*this)(argument));
          return checked(evaluate_call(c.fn, arguments[0], arguments.back()), e,
                         fmt::format("{}({}) is undefined or too large", name_of(c.fn), arguments.front()));
        },
        [&](const Select& s) { return (*this)((*this)(s.condition) != 0 ? s.yes : s.no); },
        [](const Derivative&) -> double { unreachable("a derivative in a number"); },
        [](const Advect&) -> double { unreachable("advection in a number"); },
        [](const Shift&) -> double { unreachable("a neighbour in a number"); },
        [](const Interpolate&) -> double { unreachable("an interpolation in a number"); },
        [](const BandPass&) -> double { unreachable("waves in a number"); },
        [](const Sample&) -> double { unreachable("a sample in a number"); },
        [](const Reduce&) -> double { unreachable("a reduction in a number"); },
        [](const Apply&) -> double { unreachable("an operator in a number"); },
        [](const NetworkCall&) -> double { unreachable("a network in a number"); },
        [](const Solve&) -> double { unreachable("a solve in a number"); });
  }

  Value finish(double number) const { return {number, mistake_, at_}; }

 private:
  double checked(double value, const Expr& e, const std::string& mistake) {
    if (!std::isfinite(value) && mistake_.empty()) {
      mistake_ = mistake;
      at_ = e->origin.range;
    }
    return value;
  }

  const std::map<std::string, std::optional<double>>& values_;
  std::string mistake_;
  SourceRange at_;
};

}  // namespace

Value value_of(const Expr& e, const std::map<std::string, std::optional<double>>& values) {
  Evaluation evaluation(values);
  const double number = evaluation(e);
  return evaluation.finish(number);
}

void fix_params(Elaboration& elaboration, const Expr& formula) {
  any_part(formula, [&](const Expr& part) {
    if (const auto* param = as<Param>(part)) elaboration.params.fixed.insert(param->name);
    return false;
  });
}

std::optional<double> made_once(Elaboration& elaboration, const Expr& formula, SourceRange range,
                                std::optional<double> t) {
  fix_params(elaboration, formula);
  auto known = elaboration.params.values;
  if (t) known["t"] = t;
  const Value value = value_of(formula, known);
  if (value.mistake.empty()) return value.number;
  elaboration.sink.report("not-finite", value.at.is_known() ? value.at : range, {value.mistake});
  return std::nullopt;
}

std::optional<double> evaluate(Elaboration& elaboration, const ast::Expr& e, const std::string& what) {
  const std::optional<Expr> formula = formulas::number({elaboration, FormulaContext::number, what}, e);
  return formula ? made_once(elaboration, *formula, e.range()) : std::nullopt;
}

}  // namespace dpde::model
