// SPDX-License-Identifier: Apache-2.0
// Which functions, operators and networks a text calls.
#pragma once

#include <set>
#include <string>

#include "syntax/ast.h"

namespace dpde::ast {

/// Adds the names in front of ( in `e` to `names`.
void add_calls(const Expr& e, std::set<std::string>& names);

/// The names that the lets and equations of the model call.
std::set<std::string> calls_of(const Model& model);
/// Those of the body and of the adjoints.
std::set<std::string> calls_of(const Function& function);

}  // namespace dpde::ast
