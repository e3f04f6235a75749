// SPDX-License-Identifier: Apache-2.0
// Fields of spectra and correlations: a field or vector computed from the states in every cell.
#include <fmt/format.h>

#include <algorithm>

#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

constexpr double usual_threshold = 0.8;

/// Waves require periodic, uniform axes.
bool has_waves(Elaboration& elaboration, SourceRange range) {
  for (const Axis& axis : elaboration.problem.axes) {
    if (axis.topology == Topology::periodic && !axis.stretch) continue;
    elaboration.sink.report(
        "not-allowed-here", range,
        {"a spectrum",
         fmt::format("a scene whose axis {} is {}", axis.name, axis.stretch ? "stretched" : "not periodic")},
        "its waves need periodic axes with cells of one width; statistic and correlation do without");
    return false;
  }
  return true;
}

double threshold_of(Elaboration& elaboration, const ast::TestItem& item) {
  if (!item.above) return usual_threshold;
  const auto value = evaluate(elaboration, *item.above, "the threshold");
  if (!value || (*value > 0 && *value < 1)) return value.value_or(usual_threshold);
  elaboration.sink.report("bad-optimiser-option", item.above->range(),
                          {"the threshold", item.name.name, fmt::format("lies between 0 and 1: {} does not", *value)});
  return usual_threshold;
}

}  // namespace

/// The test's number is the mean energy, whose parts are the spectrum; it determines the fields read and their
/// placement.
bool bind_fields(Elaboration& elaboration, const ast::TestItem& item, Test& test) {
  const bool is_spectrum = item.kind == ast::TestItem::Kind::spectrum;
  const char* what = is_spectrum ? "the field of a spectrum" : "the field of a correlation";
  const SourceRange range = item.value.range();
  const TypedExpr value = formulas::numeric({elaboration, FormulaContext::quantity, what}, item.value);
  if (value.type == TypedExpr::Type::none || (is_spectrum && !has_waves(elaboration, range))) return false;
  const auto is_sample = [](const Expr& part) { return is<Sample>(part); };
  if (std::ranges::any_of(value.parts, [&](const Expr& each) { return any_part(each, is_sample); })) {
    elaboration.sink.report("not-allowed-here", range, {"the point value sample", what});
    return false;
  }
  Expr energy = 0.0;
  for (const Expr& each : value.parts) {
    const Expr square = binary(BinaryOp::multiply, each, each, {range});
    energy = binary(BinaryOp::add, energy,
                    binary(BinaryOp::multiply, 0.5, reduce(Reduce::Kind::mean, square, {range}), {range}), {range});
  }
  test.quantity.value = energy;
  test.fields = value.parts;
  if (!is_spectrum) test.threshold = threshold_of(elaboration, item);
  return true;
}

}  // namespace dpde::model
