// SPDX-License-Identifier: Apache-2.0
// Where names of arrays stand in a line of a model, a scene or a task.
#pragma once

#include <functional>
#include <vector>

#include "syntax/ast.h"

namespace dpde::ast {

/// What the line is about, nullptr where nothing: the line stands for each element of it.
Identifier* target_of(Item& item);
/// Names in lists, those that are declared and those that are only listed: each element stands there by itself.
std::vector<Identifier>* list_of(Item& item);
/// One for each name of such a list, where it declares them; else null.
std::vector<UnitText>* units_of(Item& item);
/// The formulas that give the target its value, of a boundary one for each side; of a tuple each element gets its own.
std::vector<Expr*> values_of(Item& item);
/// All formulas, that one too.
std::vector<Expr*> formulas_of(Item& item);
/// What is given to the element `at` by a tuple; what is no tuple stays.
void take_part(Expr& value, const std::vector<int>& at);
/// Those of `elements` in the place of each name that has no formula.
void put_names(std::vector<NamedFormula>& list,
               const std::function<std::vector<Identifier>(const Identifier& name)>& elements);

}  // namespace dpde::ast
