// SPDX-License-Identifier: Apache-2.0
// solid = x^2 + y^2 < 1: masks by a condition of the scene. A mask with t or a control moves: it is not a field of the
// scene, and its formula is substituted wherever it is read.
#include <algorithm>
#include <variant>

#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

bool moves(const Elaboration& elaboration, const Expr& condition) {
  return any_part(condition, [&](const Expr& part) {
    const auto* param = as<Param>(part);
    return param != nullptr && (param->name == "t" || elaboration.params.controls.contains(param->name));
  });
}

/// The formula as a field at the cell centres, computed when a stage needs it; matrices that depend on it are kept as
/// long as its values. Its argument is not read and only makes it a non-uniform field at the centres.
Expr stored(const std::string& name, const Expr& formula, Origin origin) {
  return apply({{name, {name}, {formula}, {}}, {coordinate(0)}, 0, {Placement{}}, {Placement{}}}, origin);
}

}  // namespace

void bind_masks(Elaboration& elaboration) {
  for (const auto& [item, range] : items_of<ast::ValueItem>(elaboration.blocks.scene->items)) {
    auto& coefficients = elaboration.problem.coefficients;
    const auto mask = std::ranges::find(coefficients, item.name.name, &Coefficient::name);
    if (mask == coefficients.end() || !mask->is_mask || is_load(item.value)) continue;
    const SourceRange at = item.value.range();
    mask->value.origin = {at};
    const auto inside = formulas::condition({elaboration, FormulaContext::mask, item.name.name}, item.value);
    if (!inside) continue;
    const Expr value = select(*inside, 1.0, 0.0, {at});
    if (!moves(elaboration, *inside)) {
      mask->value.formula = value;
      continue;
    }
    elaboration.masks.moving.emplace(item.name.name, stored(item.name.name, value, {at}));
    coefficients.erase(mask);
  }
}

}  // namespace dpde::model
