// SPDX-License-Identifier: Apache-2.0
// Functions, operators and networks called in a text, and names used in it.
#pragma once

#include <functional>
#include <set>
#include <string>

#include "syntax/ast.h"

namespace dpde::ast {

/// Adds the names of functions called in `e` to `names`.
void add_calls(const Expr& e, std::set<std::string>& names);

/// Calls `f` with each name that denotes a value.
void for_each_name(const Expr& e, const std::function<void(const std::string&)>& f);

/// Names called by the model's lets and equations.
std::set<std::string> calls_of(const Model& model);
/// Names called by the body and the adjoints.
std::set<std::string> calls_of(const Function& function);

}  // namespace dpde::ast
