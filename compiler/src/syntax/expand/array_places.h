// SPDX-License-Identifier: Apache-2.0
// Positions of array names in a line of a model, a scene or a task.
#pragma once

#include <functional>
#include <vector>

#include "syntax/ast.h"

namespace dpde::ast {

/// The name that the line defines, or nullptr: the line applies to each element of it.
Identifier* target_of(Item& item);
/// Names in a list, declared or just listed; each is replaced by its elements.
std::vector<Identifier>* list_of(Item& item);
/// Units of such a list, one for each name, if it declares the names; else null.
std::vector<UnitText>* units_of(Item& item);
/// Formulas for the target's value; for a boundary one for each side. A tuple gives each element its own part.
std::vector<Expr*> values_of(Item& item);
/// All formulas of the line, including those.
std::vector<Expr*> formulas_of(Item& item);
/// Replaces a tuple by its part for the element `at`; other values stay.
void take_part(Expr& value, const std::vector<int>& at);
/// Replaces each name without a formula by its `elements`.
void put_names(std::vector<NamedFormula>& list,
               const std::function<std::vector<Identifier>(const Identifier& name)>& elements);

}  // namespace dpde::ast
