// SPDX-License-Identifier: Apache-2.0
// Which functions, operators and networks a text calls, and which names stand in it.
#pragma once

#include <functional>
#include <set>
#include <string>

#include "syntax/ast.h"

namespace dpde::ast {

/// Adds the names in front of ( in `e` to `names`.
void add_calls(const Expr& e, std::set<std::string>& names);

/// Calls `f` with each name that stands for a value.
void for_each_name(const Expr& e, const std::function<void(const std::string&)>& f);

/// The names that the lets and equations of the model call.
std::set<std::string> calls_of(const Model& model);
/// Those of the body and of the adjoints.
std::set<std::string> calls_of(const Function& function);

}  // namespace dpde::ast
